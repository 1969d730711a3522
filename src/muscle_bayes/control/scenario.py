"""What happens to a joint: a setpoint and a load over time."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float, Int


class Course(NamedTuple):
    """A scenario on the grid of control periods: what a compiled simulation takes."""

    setpoint: Float[Array, " period"]
    """rad"""
    load: Float[Array, " period"]
    """Hanging mass [kg]."""
    trained: Float[Array, ""]
    """1: muscles come from training and have been mounted just now; 0: they have rested."""
    disturbed: Float[Array, ""]
    """Share of the sensors' noise that is there, 0 or 1."""
    cycle: Int[Array, ""]
    """Periods of one cycle of the setpoint; 0 where it does not repeat."""
    judged_from: Int[Array, ""]
    """First period that metrics look at."""


class Scenario(NamedTuple):
    """A named course."""

    name: str
    about: str
    course: Course

    @property
    def length(self) -> int:
        """Control periods."""
        return int(np.shape(self.course.setpoint)[0])
