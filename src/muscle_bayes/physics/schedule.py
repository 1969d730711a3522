"""What is imposed on a plant over one run, on the grid of times on which it is solved."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.effect import TemperatureFilter
from muscle_bayes.physics.plant import Drive


class Schedule(NamedTuple):
    """Node times and, between nodes, the drive: temperature linear, load and force constant.

    Jumps of the load lie on nodes. Intervals of zero length pad runs to one shape and do nothing, but
    for the first of `from_rest`.
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

    @property
    def first(self) -> Drive:
        """What is imposed in the first row."""
        return Drive(self.temperature[0], self.load[0], self.applied[0])

    @property
    def from_rest(self) -> "Schedule":
        """The schedule after an interval of no length under the first drive, to come to rest in."""
        longer = Schedule(*(jnp.concatenate([one[:1], one]) for one in self))
        return longer._replace(braking=longer.braking.at[0].set(0.0))


def filtered(schedule: Schedule, filters: tuple[TemperatureFilter, ...]) -> Schedule:
    """The schedule with each filter applied to the courses of both temperatures."""
    for one in filters:
        passed = jax.vmap(partial(one, schedule.time), 1, 1)
        schedule = schedule._replace(
            temperature=passed(schedule.temperature), braking=passed(schedule.braking)
        )
    return schedule
