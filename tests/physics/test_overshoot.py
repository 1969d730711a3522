"""The overshoot of slow motion against full inertia, and against its own scaled equation."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from example_plants import J, creep, muscle_plant, release, schedule
from scipy.integrate import solve_ivp

from muscle_bayes.physics.effects import ViscousFriction
from muscle_bayes.physics.overshoot import FREE_LEAD, ahead, lead, overshoot
from muscle_bayes.physics.plant import Drive

LOAD = 0.212
PEAK, CURVATURE = 80.0, 1.5
AFTER = 2.0


def lead_of_scaled_rotor(start: float, damping: float) -> float:
    """Final y of y'' + 2 zeta y' + y = x, x = -t^2/2, that sticks at y' = 0 until x passes it."""
    t, y = start, -(start**2) / 2

    def stops(t, state):
        return state[1]

    stops.terminal, stops.direction = True, -1
    while t < 0.0:
        swing = solve_ivp(
            lambda t, s: (s[1], -(t**2) / 2 - s[0] - 2 * damping * s[1]),
            (t, t + (200.0 if damping else 10.0)),
            (y, 1e-9),
            events=stops,
            rtol=1e-7,
            atol=1e-8,
        )
        t, y = swing.t[-1], swing.y[0, -1]
        if y >= -1e-6 or t >= 0.0:
            break
        t = max(t, -np.sqrt(-2.0 * y))
    return y


@pytest.mark.parametrize("damping", [0.0, 0.02, 0.05, 0.1, 0.5])
def test_mean_lead_is_that_of_the_scaled_equation(damping):
    """Without inertia, 2 zeta y' + y = x ends at -2 zeta^2: the lead is what inertia adds to that."""
    starts = -np.random.default_rng(0).uniform(60.0, 90.0, 120)
    leads = [lead_of_scaled_rotor(start, damping) + 2.0 * damping**2 for start in starts]
    error = np.std(leads) / np.sqrt(len(leads))
    assert error < 0.2
    assert abs(np.mean(leads) - lead(damping)) < 3.0 * error + 0.1
    assert np.max(leads) < 6.3


def heating(start: float):
    """Temperature over the seconds after `start` [s before the peak], and its braking."""
    time = np.linspace(0.0, start + AFTER, 801)
    return schedule(time, lambda t: PEAK - 0.5 * CURVATURE * (t - start) ** 2, LOAD, 0.0, CURVATURE)


def test_slow_motion_ends_where_inertia_carries_the_rotor_on_average():
    made = muscle_plant()
    still = jnp.asarray(0.0)
    drive = Drive(jnp.full(2, PEAK), jnp.asarray(LOAD), still)
    misses, plain = [], []
    for start in np.linspace(5.0, 6.5, 24):
        driven = heating(start)
        # Both begin at rest where friction is just overcome, so that all of the heating slides.
        first = creep(made, driven, -0.2, 0.02).sensed[0]
        full = release(made, driven, first, 0.02).sensed[-1]
        misses.append(full - creep(made, driven, first, 0.02).sensed[-1])
        unbraked = driven._replace(braking=jnp.zeros_like(driven.braking))
        plain.append(full - creep(made, unbraked, first, 0.02).sensed[-1])
    misses, plain = np.array(misses), np.array(plain)
    assert np.abs(plain.mean()) > 5.0 * plain.std() / np.sqrt(plain.size)
    assert np.abs(misses.mean()) < 0.35 * np.abs(plain.mean())
    assert np.all(overshoot(made, first, jnp.full(2, 0.02), drive) > 0.0)


def test_damping_and_lack_of_inertia_limit_the_overshoot():
    drive = Drive(jnp.full(2, PEAK), jnp.asarray(0.0), jnp.asarray(0.0))
    at = jnp.asarray(-0.2), jnp.full(2, 0.02), drive

    def falling(plant):
        return overshoot(plant, *at)[0]

    free = falling(muscle_plant())
    damped = falling(muscle_plant() + ViscousFriction(coefficient=0.1))
    np.testing.assert_allclose(damped / free, lead(1.0) / lead(0.0), rtol=1e-6)
    np.testing.assert_allclose(falling(muscle_plant(inertia=0.5 * J)) / free, 0.5, rtol=1e-6)
    assert falling(muscle_plant(inertia=0.0)) == 0.0
    slope = jax.grad(lambda inertia: falling(muscle_plant(inertia=inertia)))
    np.testing.assert_allclose(slope(J), free / J, rtol=1e-6)


@pytest.mark.parametrize("slack", [-2.0, 2.0])
def test_slack_and_unstable_states_give_a_bounded_overshoot(slack):
    drive = Drive(jnp.full(2, PEAK), jnp.asarray(0.0), jnp.asarray(0.0))
    value = overshoot(muscle_plant(), jnp.asarray(slack), jnp.full(2, 0.5), drive)
    assert np.all((value >= 0.0) & (value <= 0.25 * FREE_LEAD))


def test_it_does_not_depend_on_where_in_its_dead_band_the_rotor_began():
    """Nor does the course of temperatures that slow motion follows."""
    made = muscle_plant()
    driven = heating(6.0)
    hyst = jnp.full(2, 0.02)
    starts = jnp.linspace(-0.6, 0.2, 9)
    known = np.stack([overshoot(made, start, hyst, driven.first) for start in starts])
    np.testing.assert_allclose(known, np.broadcast_to(known[0], known.shape), rtol=1e-6)
    assert known[0, 0] != pytest.approx(known[0, 1], rel=1e-3)
    courses = np.stack([ahead(made, start, hyst, driven) for start in starts])
    np.testing.assert_allclose(courses, np.broadcast_to(courses[0], courses.shape), rtol=1e-6)


def test_each_side_s_course_is_that_of_the_way_on_which_it_pulls_the_rotor():
    """Heating that slows down ends a slide towards the side heated, cooling one away from it."""
    made, hyst, at = muscle_plant(), jnp.full(2, 0.02), jnp.asarray(-0.2)
    driven = heating(6.0)

    def pull(row: int) -> float:
        first = driven.first
        warmed = first.temperature.at[0].set(driven.temperature[row, 0])
        return float(made.force(at, jnp.asarray(0.0), hyst, first._replace(temperature=warmed)))

    way = int(pull(-1) > pull(0))
    for sign, course in ((1.0, way), (-1.0, 1 - way)):
        turning = driven._replace(braking=sign * driven.braking)
        times = overshoot(made, at, hyst, turning.first)[course]
        expected = times * turning.braking[:, 0]
        np.testing.assert_allclose(ahead(made, at, hyst, turning)[:, 0], expected, rtol=1e-6)
