"""Forward-mode derivatives against central differences, away from the kinks of the response."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from example_plants import (
    TABLE_2,
    D,
    J,
    muscle_plant,
    schedule,
    spring_plant,
)

from muscle_bayes.physics.effects import BiasTorque, CoilContact, ThermalLag, ViscousFriction
from muscle_bayes.physics.response import inertial_response, quasi_static_response
from muscle_bayes.physics.solvers.play import play

MUSCLE = {
    **TABLE_2,
    "J": J,
    "D": D,
    "stiffness": 150.0,
    "onset": 0.02,
    "width": 0.01,
    "torque": 0.004,
}
MUSCLE |= {"coefficient": 0.002, "time_constant": 3.0, "hyst": 0.04}


def spring_response(values):
    made = spring_plant(values["J"], values["D"])
    time = np.linspace(0.0, 3.0, 301)
    return inertial_response(
        made, schedule(time, load=0.14), values["q"], jnp.asarray(0.0), jnp.zeros(2)
    ).sensed


def rig(values):
    p = dict(values)
    j, d = p.pop("J"), p.pop("D")
    made = muscle_plant(j, d, **{key: p[key] for key in TABLE_2})
    made = (
        made + ThermalLag(p["time_constant"]) + CoilContact(p["stiffness"], p["onset"], p["width"])
    )
    return made + ViscousFriction(p["coefficient"]) + BiasTorque(p["torque"])


def fast_muscle_response(values):
    driven = schedule(
        np.linspace(0.0, 2.4, 1201),
        lambda t: 25.0 + 15.0 * np.minimum(t, 2.0),
        lambda t: np.where(t < 1.4, 0.15, 0.12),
        lambda t: np.where((t > 1.0) & (t < 1.4), -0.2, 0.0),
    )
    hyst = jnp.stack([values["hyst"], values["hyst"]])
    start = jnp.asarray(0.0), jnp.asarray(0.0)
    return inertial_response(rig(values), driven, *start, hyst).sensed[::6]


def slow_muscle_response(values):
    def heat(t):
        return 25.0 + 70.0 * np.interp(t, [0, 20, 60, 160, 220], [0, 0, 1, 1, 0])

    driven = schedule(
        np.linspace(0.0, 240.0, 241),
        heat,
        lambda t: np.where(t < 100.0, 0.03, 0.16),
        lambda t: np.where((t > 110.0) & (t < 130.0), -0.2, 0.0),
    )
    hyst = jnp.stack([values["hyst"], values["hyst"]])
    return quasi_static_response(rig(values), driven, jnp.asarray(-0.4), hyst).sensed


def both_derivatives(response, values, relative):
    """Jacobians by forward mode and by central differences, parameters scaled by their values."""
    names, centre = list(values), jnp.asarray(list(values.values()))

    def scaled(x):
        return response(dict(zip(names, x * centre, strict=True)))

    one = jnp.ones(len(names))
    steps = relative * jnp.eye(len(names))
    forward = jax.jit(jax.jacfwd(scaled))(one).T
    ends = jax.jit(jax.vmap(scaled))(jnp.concatenate([one + steps, one - steps]))
    up, down = jnp.split(ends, 2)
    return names, np.asarray(forward), np.asarray(up - down) / (2 * relative)


def relative_errors(names, forward, central):
    return {
        name: np.linalg.norm(a - b) / max(np.linalg.norm(b), 1e-3)
        for name, a, b in zip(names, forward, central, strict=True)
    }


def test_swing_until_it_sticks():
    values = {"J": J, "D": D, "q": -0.25}
    errors = relative_errors(*both_derivatives(spring_response, values, 1e-6))
    assert max(errors.values()) < 1e-7


@pytest.mark.parametrize("response", [fast_muscle_response, slow_muscle_response])
def test_muscle_through_slack_contact_and_sticking(response):
    names, forward, central = both_derivatives(response, MUSCLE, 1e-6)
    errors = relative_errors(names, forward, central)
    assert max(errors.values()) < 1e-5, errors
    # Inertia divides a balance of forces and leaves it as it is, but for rounding.
    known = {name for name, row in zip(names, forward, strict=True) if np.abs(row).max() > 1e-7}
    assert known == set(names) - ({"J"} if response is slow_muscle_response else set())


def test_play_differentiates_as_the_implicit_equation_says():
    def rest(k, dry, q):
        return play(lambda x, p: (-p[0] * jnp.sinh(x), p[1]), q, (k, dry), (-9.0, 9.0))

    edge = np.arcsinh(0.25)
    outside = jnp.asarray(2.0), jnp.asarray(0.5), jnp.asarray(1.0)
    exact = -0.125 / np.cosh(edge), 0.5 / np.cosh(edge), 0.0
    np.testing.assert_allclose(jax.jacfwd(rest, (0, 1, 2))(*outside), exact, rtol=1e-12)
    inside = jnp.asarray(2.0), jnp.asarray(0.5), jnp.asarray(0.2)
    assert [float(one) for one in jax.jacfwd(rest, (0, 1, 2))(*inside)] == [0.0, 0.0, 1.0]


def test_play_that_breaks_away_differentiates_by_the_sliding_level_alone():
    def rest(sliding, static):
        def forces(x, levels):
            return -2.0 * x, jnp.where(x == 1.0, levels[1], levels[0])

        return play(forces, jnp.asarray(1.0), (sliding, static), (-9.0, 9.0))

    by_both = jax.jacfwd(rest, (0, 1))(jnp.asarray(0.5), jnp.asarray(0.9))
    np.testing.assert_allclose(by_both, (0.5, 0.0), rtol=1e-12)


def test_play_at_a_stop_moves_with_the_stop_alone():
    def rest(k, stop):
        return play(lambda x, k: (-k * x, 0.5), jnp.asarray(3.0), k, (stop, 9.0))

    by_k, by_stop = jax.jacfwd(rest, (0, 1))(jnp.asarray(2.0), jnp.asarray(1.0))
    assert (float(by_k), float(by_stop)) == (0.0, 1.0)


def test_a_rotor_at_its_stop_forgets_how_it_came_there():
    @jax.jit
    def end(j):
        made = spring_plant(j, D, stops=(-1.2, 0.2))
        driven = schedule(np.linspace(0.0, 1.0, 101), load=lambda t: np.where(t < 0.6, 0.3, 0.02))
        zero = jnp.asarray(0.0)
        return inertial_response(made, driven, zero, zero, jnp.zeros(2)).sensed

    at = jnp.asarray(J)
    value, slope = end(at), jax.jit(jax.jacfwd(end))(at)
    assert float(value[58]) == 0.2
    assert float(slope[58]) == 0.0
    assert value[-1] < 0.1
    assert np.isfinite(slope).all()
    central = (end(at * 1.000001) - end(at * 0.999999)) / (2e-6 * at)
    np.testing.assert_allclose(slope[-1], central[-1], rtol=1e-6)
