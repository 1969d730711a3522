"""`simulate` under JAX's transforms, at any times, and its word for a solve that fails."""

import doctest

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from example_plants import TABLE_2, D, J, muscle_plant, schedule, spring_plant

from muscle_bayes.physics import simulation
from muscle_bayes.physics.effects import FirstCycleSet, StribeckFriction
from muscle_bayes.physics.schedule import Schedule
from muscle_bayes.physics.simulation import initial_state, simulate
from muscle_bayes.physics.solvers import QuasiStatic, StickSlip

TIMES = jnp.linspace(0.0, 2.0, 201)
SPRING = {"J": J, "D": D, "q": -0.25, "load": 0.14, "drop": 0.2}
MUSCLE = {**TABLE_2, "D": D, "q": -0.2, "hyst": 0.04, "load": 0.139, "heat": 32.5, "gain": 2e-4}
COURSE = np.linspace(0.0, 120.0, 121)


def swing(p):
    """A spring that is let go, swings and sticks."""
    made = spring_plant(p["J"], p["D"]) + StribeckFriction(p["drop"], jnp.asarray(0.5))
    drive = Schedule.sampled([0.0, 2.0], load=p["load"])
    return simulate(made, drive, initial_state(made, drive, p["q"]), times=TIMES).ys.q[::20]


def heated(p):
    """A muscle that is heated and cooled, with training that stays."""
    made = muscle_plant(dry=p["D"], **{key: p[key] for key in TABLE_2})
    made = made + FirstCycleSet(p["gain"], jnp.asarray(20.0), jnp.asarray(0.01))
    heat = 25.0 + p["heat"] * (1.0 - jnp.cos(2.0 * jnp.pi * COURSE / 80.0))
    drive = Schedule.sampled(COURSE, heat, p["load"])
    state = initial_state(made, drive, p["q"], 0.0, p["hyst"])
    return simulate(made, drive, state, solver=QuasiStatic()).ys.q[::20]


def scaled(response, values):
    """The response as a function of each value's share of what it is."""
    return lambda share: response({key: one * share[key] for key, one in values.items()})


cases = pytest.mark.parametrize(
    ("response", "values"), [(swing, SPRING), (heated, MUSCLE)], ids=["stick-slip", "quasi-static"]
)


@cases
def test_forward_reverse_and_finite_differences_agree(response, values):
    ones = {key: jnp.ones(()) for key in values}
    function = scaled(response, values)
    forward = jax.jit(jax.jacfwd(function))(ones)
    reverse = jax.jit(jax.jacrev(function))(ones)
    step, value = 1e-6, jax.jit(function)
    for key in values:
        size = max(float(jnp.linalg.norm(forward[key])), 1e-3)
        np.testing.assert_allclose(reverse[key], forward[key], atol=1e-10 * size)
        ends = (value(ones | {key: ones[key] + sign * step}) for sign in (1.0, -1.0))
        up, down = ends
        np.testing.assert_allclose(forward[key], (up - down) / (2.0 * step), atol=1e-5 * size)


@cases
def test_many_at_once_are_as_one_by_one(response, values):
    shares = {key: jnp.linspace(0.9, 1.1, 3) for key in values}
    function = scaled(response, values)
    together = jax.jit(jax.vmap(function))(shares)
    single = jax.jit(function)
    for index in range(3):
        alone = single({key: one[index] for key, one in shares.items()})
        np.testing.assert_allclose(together[index], alone, rtol=0.0, atol=1e-12)


def test_the_course_of_temperature_has_derivatives_too():
    made, time = muscle_plant(), np.linspace(0.0, 60.0, 61)

    def end(heat):
        drive = Schedule.sampled(time, heat, 0.139)
        return simulate(made, drive, initial_state(made, drive, -0.2), solver=QuasiStatic()).ys.q[
            -1
        ]

    heat = jnp.asarray(25.0 + time)
    slope = jax.jit(jax.grad(end))(heat)
    along = jnp.asarray(np.sin(time))
    ends = [float(jax.jit(end)(heat + sign * 1e-5 * along)) for sign in (1.0, -1.0)]
    assert float(slope @ along) == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-6)


@pytest.mark.parametrize("solver", [StickSlip(), QuasiStatic()])
def test_states_are_those_at_the_times_that_are_wanted(solver):
    made = muscle_plant()
    drive = schedule(np.linspace(0.0, 3.0, 301), lambda t: 30.0 + 10.0 * t, 0.139)
    state = initial_state(made, drive, -0.2, 0.0, 0.04)
    whole = simulate(made, drive, state, solver=solver)
    assert whole.ts.shape == whole.ys.q.shape == (301,)
    some = simulate(made, drive, state, solver=solver, times=drive.time[50:200:10])
    np.testing.assert_array_equal(some.ts, drive.time[50:200:10])
    np.testing.assert_allclose(some.ys.q, whole.ys.q[50:200:10], atol=1e-14)
    np.testing.assert_allclose(some.ys.hyst, whole.ys.hyst[50:200:10], atol=1e-14)
    start = state.q if isinstance(solver, StickSlip) else whole.ys.q[0]
    assert float(whole.ys.q[0]) == float(start)
    assert whole.ys.speed[0] == 0.0
    assert (whole.t0, whole.t1) == (0.0, 3.0)


@pytest.mark.parametrize("solver", [StickSlip(), QuasiStatic()])
def test_a_solve_that_does_not_stay_finite_says_so(solver):
    drive = schedule(np.linspace(0.0, 1.0, 11), load=0.139)
    good, bad = muscle_plant(), muscle_plant(K_modulus=np.nan)
    state = initial_state(good, drive)
    assert simulate(good, drive, state, solver=solver).result == diffrax.RESULTS.successful
    found = simulate(bad, drive, state, solver=solver, throw=False)
    assert found.result != diffrax.RESULTS.successful
    with pytest.raises(Exception, match="diverge"):
        simulate(bad, drive, state, solver=solver)


def test_the_example_of_the_docstring_runs():
    example = doctest.DocTestFinder().find(simulation.simulate, "simulate")[0]
    run = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(example)
    assert run.attempted > 5
    assert run.failed == 0
