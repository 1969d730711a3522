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
    braking: Float[Array, "node 2"]
    """How heating or cooling of sides A and B slows down towards a turn [C/s^2], with the sign of
    the temperature's rate; zero where it does not. Used by slow motion only."""


def filtered(schedule: Schedule, filters: tuple[TemperatureFilter, ...]) -> Schedule:
    """The schedule with each filter applied to both temperatures, from steady state at the start."""
    for one in filters:
        steps = jnp.diff(schedule.time)

        def advance(memory, step, one=one):
            after = one.advance(memory, *step)
            return after, after

        def apply(values, steps=steps, advance=advance):
            _, rest = jax.lax.scan(advance, values[0], (values[:-1], values[1:], steps))
            return jnp.concatenate([values[:1], rest])

        # Filters are linear and do not change in time: they pass derivatives as they pass values.
        schedule = schedule._replace(
            temperature=apply(schedule.temperature), braking=apply(schedule.braking)
        )
    return schedule
