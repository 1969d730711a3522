"""What a load cell shows where the coordinate is imposed: isometric, tensile and other forced tests."""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.response import Response
from muscle_bayes.physics.schedule import Schedule, filtered
from muscle_bayes.physics.simulation import initial_state
from muscle_bayes.physics.solvers.exponential_midpoint import (
    Memory,
    exponential_step,
    paired,
    stacked,
)
from muscle_bayes.physics.state import Drive

HYST = "hyst"
"""Name of sigma_hyst among the states that relax."""


def imposed_response(
    plant: Plant,
    schedule: Schedule,
    imposed: Float[Array, "interval 2"],
    hyst: Float[Array, "2"],
) -> Response:
    """Mean tension of side A's element in each interval, from the mean coordinate and speed there.

    Args:
        plant: only its elements and their effects count.
        schedule: temperatures [C] at the nodes.
        imposed: mean coordinate [rad or m] and speed in each interval.
        hyst: sigma_hyst of both sides at the first node.

    Returns:
        `sensed` and `averaged` are the tension [N], or the torque [N m] of an element without a length;
        `hyst` that at the intervals' ends, `speed` that of the coordinate.
    """
    schedule = filtered(schedule, plant.temperature_filters)
    effects, sides = plant.instant_effects, (plant.side_a, plant.side_b)
    relaxing = tuple(place for place, side in enumerate(sides) if side.relaxes)
    q, speed = imposed.T
    state = initial_state(plant, schedule, q[0], 0.0, hyst)
    duration = jnp.diff(schedule.time)
    heat = schedule.temperature
    drives = Drive(0.5 * (heat[1:] + heat[:-1]), schedule.load, schedule.applied)
    first: Memory = paired({HYST: state.hyst, **(state.memory or {})})

    def step(now: Memory, interval: tuple[Scalar, Scalar, Scalar, Drive]) -> Any:
        middle, speed, lasting, drive = interval

        def rates(states: Memory) -> Mapping[str, Any]:
            own = {name: pair for name, pair in states.items() if name != HYST}
            held = plant.remembering(stacked(own))
            at = middle, speed, states[HYST], drive
            return {HYST: held.hyst_rates(*at), **held.memory_rates(*at)}

        half = exponential_step(rates, now, now, 0.5 * lasting, relaxing)
        there = exponential_step(rates, half, now, lasting, relaxing)
        own = {name: pair for name, pair in half.items() if name != HYST}
        held = plant.remembering(stacked(own))
        instant = held.instants(middle, speed, half[HYST], drive)[0]
        return there, (plant.side_a.tension(instant, effects), jnp.stack(there[HYST]))

    _, (tension, after) = jax.lax.scan(step, first, (q, speed, duration, drives))
    finite = jnp.isfinite(tension).all() & jnp.isfinite(after).all()
    return Response(tension, tension, after, speed, finite)
