"""Our solvers are limits of general ones on the same terms: of smoothed friction, and of little damping."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from example_plants import (
    D,
    J,
    muscle,
    muscle_plant,
    plant,
    release,
    schedule,
    spring_plant,
)

from muscle_bayes.physics.effects import SecondRelaxation
from muscle_bayes.physics.friction import LinearFriction
from muscle_bayes.physics.schedule import filtered
from muscle_bayes.physics.simulation import initial_state, simulate
from muscle_bayes.physics.solvers import QuasiStatic, StickSlip
from muscle_bayes.physics.state import PlantState


def slopes(errors, ratio):
    """Orders of convergence between successive values of what goes to 0."""
    errors = np.asarray(errors)
    return np.log(errors[:-1] / errors[1:]) / np.log(ratio)


def distances(paths, limit):
    return [float(np.sqrt(np.mean((path - limit) ** 2))) for path in paths]


@eqx.filter_jit
def generally(term, solver, drive, state, times, tolerance):
    """Coordinates by one of diffrax's own solvers, told where the drive jumps."""
    controller = diffrax.PIDController(rtol=tolerance, atol=tolerance * 1e-2)
    solution = diffrax.diffeqsolve(
        term,
        solver,
        drive.t0,
        drive.t1,
        1e-3,
        state,
        drive,
        saveat=diffrax.SaveAt(ts=times),
        stepsize_controller=diffrax.ClipStepSizeController(controller, jump_ts=drive.jump_ts),
        max_steps=200_000,
    )
    return solution.ys.q


def test_terms_are_force_and_friction_per_inertia_and_rates():
    made = muscle_plant() + SecondRelaxation(0.008, 10.0, 0.0)
    drive = schedule([0.0, 2.0, 3.0], lambda t: 40.0 + 5.0 * t, 0.139)
    y = PlantState(*map(jnp.asarray, (-0.1, 0.2)), jnp.full(2, 0.03), {})
    y = y._replace(memory={"second-relaxation": jnp.array([0.01, 0.0])})
    smooth, dry = made.terms().vf(1.0, y, drive)
    now, at = made.remembering(y.memory), drive.evaluate(jnp.asarray(1.0))
    assert float(at.temperature[0]) == 45.0
    inertia = made.inertia(at.load)
    state = y.q, y.speed, y.hyst, at
    np.testing.assert_allclose(smooth.speed * inertia, now.force(*state), rtol=1e-14)
    np.testing.assert_allclose(dry.speed * inertia, D, rtol=1e-14)
    np.testing.assert_allclose(smooth.hyst, now.hyst_rate(*state), rtol=1e-14)
    assert smooth.q == y.speed
    # The Voigt element of compliance c and time constant tau: tau ds/dt = c F - s.
    tension = now.side_a.signals(now.instants(*state)[0], now.instant_effects).tension
    expected = (0.008 * tension - 0.01) / 10.0
    np.testing.assert_allclose(smooth.memory["second-relaxation"], [expected, 0.0], rtol=1e-14)
    assert all(not np.any(leaf) for leaf in jax.tree.leaves(dry._replace(speed=0.0)))


def test_stick_slip_is_the_limit_of_friction_smoothed_less_and_less_in_tsit5():
    made = spring_plant()
    drive = schedule([0.0, 1.0, 2.5], load=lambda t: np.where(t < 1.0, 0.14, 0.12))
    state, times = initial_state(made, drive, q=-0.25), jnp.linspace(0.0, 2.5, 1001)
    limit = simulate(made, drive, state, solver=StickSlip(), times=times).ys
    assert np.any(limit.speed[1:] == 0.0), "it sticks"
    speeds = (0.01, 0.0025, 0.000625)
    paths = [
        generally(made.smoothed_terms(v0), diffrax.Tsit5(), drive, state, times, 1e-8)
        for v0 in speeds
    ]
    errors = distances(paths, limit.q)
    assert errors[-1] < 1e-3
    assert slopes(errors, 4.0).min() > 0.85, errors


def heated(t):
    return 57.5 - 32.5 * np.cos(2 * np.pi * t / 80.0)


def test_quasi_static_motion_is_the_limit_of_less_and_less_damping_in_kvaerno5():
    made = muscle_plant()
    drive = schedule(np.linspace(0.0, 120.0, 1201), heated, 0.139)
    coarse = schedule(np.linspace(0.0, 120.0, 121), heated, 0.139)
    state, times = initial_state(made, drive, q=-0.2, hyst=0.04), jnp.linspace(0.0, 120.0, 121)
    found = simulate(made, drive, state, solver=QuasiStatic(), times=times).ys
    state = state._replace(q=found.q[0])
    paths = [
        generally(made.overdamped_terms(c), diffrax.Kvaerno5(), coarse, state, times, 1e-8)
        for c in (0.04, 0.02, 0.01)
    ]
    # The drive of the coarse nodes bends less: what that changes is taken off.
    limit = simulate(made, coarse, state, solver=QuasiStatic(), times=drive.time).ys.q[::10]
    errors = distances(paths, limit)
    assert np.ptp(limit) > 0.2
    assert slopes(errors, 2.0).min() > 0.9, errors


def test_quasi_static_motion_is_the_limit_of_less_and_less_inertia_in_kvaerno5():
    """With friction in proportion to speed, so that inertia moves a path smoothly."""
    times = jnp.linspace(0.0, 60.0, 61)
    drive = schedule(np.linspace(0.0, 60.0, 121), heated)
    friction = LinearFriction(jnp.asarray(0.05))

    def light(share):
        return plant(muscle(), inertia=share * 100.0 * J, friction=friction)

    state = initial_state(light(1.0), drive, q=-0.5, hyst=0.0)
    fine = jnp.linspace(0.0, 60.0, 48001)
    limit = simulate(light(1.0), drive, state, solver=QuasiStatic(), times=fine).ys.q[::800]
    state = state._replace(q=limit[0])
    paths = [
        generally(light(s).smoothed_terms(1.0), diffrax.Kvaerno5(), drive, state, times, 1e-9)
        for s in (0.04, 0.02, 0.01)
    ]
    errors = distances(paths, limit)
    assert np.ptp(limit) > 0.05
    assert slopes(errors, 2.0).min() > 0.8, errors


def test_a_solver_of_ours_is_one_of_diffrax():
    """With diffrax's own steps, where they end at the drive's nodes."""
    made = spring_plant()
    drive = schedule(np.linspace(0.0, 1.0, 3), load=0.14)
    state = initial_state(made, drive, q=-0.25)
    solution = diffrax.diffeqsolve(
        made.terms(),
        StickSlip(stops=made.stops),
        0.0,
        1.0,
        0.01,
        state,
        drive,
        saveat=diffrax.SaveAt(steps=True),
        max_steps=100,
    )
    same = simulate(made, drive, state, times=jnp.linspace(0.0, 1.0, 101)).ys
    np.testing.assert_allclose(solution.ys.q, same.q[1:], atol=1e-12)


def test_quasi_static_alone_says_that_it_must_know_its_plant():
    made = muscle_plant()
    drive = schedule([0.0, 1.0])
    with pytest.raises(ValueError, match=r"endstops and muscles\. Fix: use `simulate`"):
        QuasiStatic().init(made.terms(), 0.0, 1.0, initial_state(made, drive), drive)


def test_what_inference_asks_for_is_the_same_simulation():
    made, drive = spring_plant(), schedule(np.linspace(0.0, 1.0, 101), load=0.14)
    ys = simulate(made, drive, initial_state(made, drive, q=-0.25)).ys
    seen = release(made, drive, -0.25)
    np.testing.assert_allclose(seen.sensed, ys.q[1:], atol=1e-14)
    np.testing.assert_allclose(seen.speed, ys.speed[1:], atol=1e-13)
    assert filtered(drive, ()) is drive
