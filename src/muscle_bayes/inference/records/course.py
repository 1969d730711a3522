"""How the coordinate of a run moved, as its readings alone tell it."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from muscle_bayes.data.run import Run
from muscle_bayes.inference.records.record import Record


class Motion(NamedTuple):
    """Coordinate and speed of a run's observed readings."""

    q: Float[np.ndarray, " reading"]
    """Coordinate [rad or m]; where a velocity is measured, from 0 at the first reading."""
    speed: Float[np.ndarray, " between"]
    """dq/dt between neighbouring readings [rad/s or m/s]."""


def course_of(run: Run, record: Record) -> Motion:
    """The motion that a run's record shows: differences of positions, or velocities and their sum."""
    seen = record.weight > 0
    shown, steps = run.output_sensor.coordinate(record.reading[seen]), np.diff(record.time[seen])
    if run.imposed is not None:
        q, time = run.coordinate, run.table["time"].to_numpy()
        return Motion(q, np.diff(q) / np.diff(time))
    if run.measured == "position":
        return Motion(shown, np.diff(shown) / steps)
    speed = 0.5 * (shown[1:] + shown[:-1])
    return Motion(np.concatenate([[0.0], np.cumsum(speed * steps)]), speed)
