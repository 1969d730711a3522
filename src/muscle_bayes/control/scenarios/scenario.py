"""What happens to a joint: a setpoint and a load over time."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Bool, Float, Int


class Course(NamedTuple):
    """A scenario on the grid of control periods: what a compiled simulation takes."""

    setpoint: Float[Array, " period"]
    """rad"""
    load: Float[Array, " period"]
    """Hanging mass [kg]."""
    since: Int[Array, " period"]
    """Periods since the setpoint or the load jumped; 0 before."""
    turned: Bool[Array, " period"]
    """After a jump of the setpoint, until the load's next."""
    towards: Float[Array, " period"]
    """Direction of the setpoint's last jump, 1 or -1; 0 before."""
    loaded: Bool[Array, " period"]
    """After a jump of the load, until the setpoint's next."""
    late: Bool[Array, " period"]
    """The last fifth of the time between jumps."""
    late_of: Int[Array, " period"]
    """Number of that stretch, below MOST_JUMPS."""
    trained: Float[Array, ""]
    """1: muscles come from training and have been mounted just now; 0: they have rested."""
    disturbed: Float[Array, ""]
    """Share of the sensors' noise that is there, 0 or 1."""
    judged_from: Int[Array, ""]
    """First period at which tracking is judged."""


MOST_JUMPS = 64
"""Jumps of setpoint and load that a scenario may have."""
LATE = 0.8
"""Where the last fifth between jumps begins."""


def _jumps(values: np.ndarray) -> np.ndarray:
    """Periods at which a value that stands still before and after changes."""
    moves = np.diff(values, prepend=values[0]) != 0.0
    beside = np.roll(moves, 1) | np.roll(moves, -1)
    return np.flatnonzero(moves & ~beside)


def course_of(
    setpoint, load, *, trained: bool = False, noise: bool = False, judged_from: int = 0
) -> Course:
    """A course from arrays over control periods."""
    setpoint, load = np.asarray(setpoint, float), np.asarray(load, float)
    turns, loads = _jumps(setpoint), _jumps(load)
    if setpoint[0] != 0.0 and not np.any(np.diff(setpoint, prepend=setpoint[0])[:2]):
        turns = np.r_[0, turns]
    size = setpoint.size
    edges = np.union1d(turns, loads).astype(int)
    index = np.arange(size)
    place = np.searchsorted(edges, index, side="right") - 1
    starts, ends = np.r_[0, edges], np.r_[edges, size]
    since = np.where(place >= 0, index - starts[place + 1], 0)
    length = ends[place + 1] - starts[place + 1]
    steps = np.sign(np.diff(setpoint, prepend=0.0))[turns]
    last = np.searchsorted(turns, index, side="right") - 1
    turned = np.isin(starts[place + 1], turns) & (place >= 0)
    return Course(
        setpoint,
        load,
        since,
        turned,
        np.where(last >= 0, np.r_[steps, 0.0][last], 0.0),
        np.isin(starts[place + 1], loads) & ~turned & (place >= 0),
        (place >= 0) & (since >= LATE * length),
        np.clip(place, 0, MOST_JUMPS - 1),
        np.asarray(float(trained)),
        np.asarray(float(noise)),
        np.asarray(judged_from),
    )


class Scenario(NamedTuple):
    """A named course."""

    name: str
    about: str
    course: Course

    @property
    def length(self) -> int:
        """Control periods."""
        return int(np.shape(self.course.setpoint)[0])
