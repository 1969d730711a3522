"""Slow motion: rotor inertia eliminated, dry friction as a play operator, HYST integrated."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from muscle_bayes.physics.equilibrium import play
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.plant import Drive, Plant
from muscle_bayes.physics.schedule import Schedule

GAMMA = 1.0 - 0.5**0.5
"""Coefficient that makes the two-stage Rosenbrock method ROS2 L-stable."""


class SlowState(NamedTuple):
    """State of slow motion."""

    q: Scalar
    """Coordinate at the end of the interval [rad or m]."""
    hyst: Float[Array, "2"]
    """sigma_hyst of sides A and B."""
    q_middle: Scalar
    """Coordinate in the middle of the interval [rad or m]."""


def settle(plant: Plant, q: Scalar, hyst, drive: Drive, duration: Scalar) -> Scalar:
    """Slide to equilibrium; effects that depend on speed see the mean speed of the move."""

    def force(x, args):
        plant, origin, hyst, drive, duration = args
        speed = jnp.where(
            duration > 0.0, (x - origin) / jnp.where(duration > 0, duration, 1.0), 0.0
        )
        return plant.force(x, speed, hyst, drive)

    args = (plant, q, hyst, drive, duration)
    return play(force, q, args, plant.friction.dry, plant.stops)


def _rate_and_slope(plant: Plant, q, hyst, drive: Drive):
    """Rates of both HYST and, since they do not see each other, the diagonal of their Jacobian."""

    def rate(value):
        return plant.hyst_rate(q, jnp.zeros_like(q), value, drive)

    return rate, *jax.jvp(rate, (hyst,), (jnp.ones_like(hyst),))


def _half_step(plant: Plant, q, hyst, drive: Drive, duration):
    """Linearly implicit Euler: enough for the predictor in the middle of a step."""
    _, value, slope = _rate_and_slope(plant, q, hyst, drive)
    return hyst + duration * value / (1.0 - duration * jnp.minimum(slope, 0.0))


def _full_step(plant: Plant, q, hyst, drive: Drive, duration):
    """ROS2 (Verwer et al., SIAM J. Sci. Comput. 20, 1999): second order, L-stable."""
    rate, value, slope = _rate_and_slope(plant, q, hyst, drive)
    inverse = 1.0 / (1.0 - GAMMA * duration * jnp.minimum(slope, 0.0))
    first = value * inverse
    second = (rate(hyst + duration * first) - 2.0 * first) * inverse
    return hyst + duration * (1.5 * first + 0.5 * second)


def slow_step(
    plant: Plant, state: SlowState, schedule: Schedule, index: Int[Array, ""]
) -> SlowState:
    """One interval: predict HYST to the middle, slide there, HYST across, slide to the end.

    HYST sees coordinate and temperature of the middle (midpoint rule), so q and sigma_hyst are
    second-order accurate in the interval's length.
    """
    duration = schedule.time[index + 1] - schedule.time[index]
    before, after = schedule.temperature[index], schedule.temperature[index + 1]
    load, applied = schedule.load[index], schedule.applied[index]
    braking = 0.5 * (schedule.braking[index] + schedule.braking[index + 1])
    # Where temperature turns, its chord would cut the peak at which friction leaves the rotor.
    half = 0.5 * (before + after) + braking * duration**2 / 8.0
    start, middle, end = (
        Drive(temperature, load, applied) for temperature in (before, half, after)
    )
    hyst_middle = _half_step(plant, state.q, state.hyst, start, 0.5 * duration)
    q_middle = settle(plant, state.q, hyst_middle, middle, 0.5 * duration)
    hyst = _full_step(plant, q_middle, state.hyst, middle, duration)
    q = settle(plant, q_middle, hyst, end, 0.5 * duration)
    # An interval of no length is padding, whatever its load: without this the rotor would slide.
    padding = duration <= 0.0
    still = SlowState(state.q, state.hyst, state.q)
    moved = SlowState(q, hyst, q_middle)
    return SlowState(*(jnp.where(padding, a, b) for a, b in zip(still, moved, strict=True)))
