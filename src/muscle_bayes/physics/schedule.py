"""What is imposed on a plant over one run, on the grid of times on which it is solved."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.effect import TemperatureFilter


class Schedule(NamedTuple):
    """Node times and, between nodes, the drive: temperature linear, load and force constant.

    Jumps of the load lie on nodes. Intervals of zero length pad runs to one shape and do nothing.
    """

    time: Float[Array, " node"]
    """Seconds after the first row, not falling."""
    temperature: Float[Array, "node 2"]
    """Heater temperature of sides A and B [C]."""
    load: Float[Array, " interval"]
    """Hanging mass [kg]."""
    applied: Float[Array, " interval"]
    """Known generalised force [N m or N]."""


def filtered(schedule: Schedule, filters: tuple[TemperatureFilter, ...]) -> Schedule:
    """The schedule with each filter applied to both temperatures, from steady state at the start."""
    for one in filters:
        temperature = schedule.temperature
        steps = (temperature[:-1], temperature[1:], jnp.diff(schedule.time))

        def advance(memory, step, one=one):
            after = one.advance(memory, *step)
            return after, after

        _, rest = jax.lax.scan(advance, temperature[0], steps)
        schedule = schedule._replace(temperature=jnp.concatenate([temperature[:1], rest]))
    return schedule
