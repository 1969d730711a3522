"""A schedule cut finely enough to follow the rotor's swings, with the same course of the drive."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float, Int

from muscle_bayes.physics.schedule import Schedule


class FineGrid(NamedTuple):
    """A schedule whose intervals are cut into steps, and where the former intervals are in it."""

    schedule: Schedule
    middle: Int[Array, " interval"]
    """Step that ends in the middle of each former interval."""
    end: Int[Array, " interval"]
    """Step that ends each former interval."""


def refined(schedule: Schedule, longest: Float[np.ndarray, " interval"], size: int = 0) -> FineGrid:
    """The schedule of one run with steps of at most `longest` [s], an even number an interval.

    Between nodes the temperature is the parabola whose bend is the mean of `braking` at both ends,
    as slow motion has it; between steps it is linear. Padding of no duration stays padding, and is
    lengthened to `size` steps. Arrays are NumPy's.
    """
    node_time, temperature = np.asarray(schedule.time), np.asarray(schedule.temperature)
    durations = np.diff(node_time)
    counts = np.where(durations > 0.0, 2 * np.ceil(0.5 * durations / longest), 0).astype(int)
    last = np.cumsum(counts)
    total = max(int(last[-1]), 1, size)
    owner = np.repeat(np.arange(durations.size), counts)
    place = (np.arange(owner.size) - (last - counts)[owner] + 1) / counts[owner]
    braking = np.asarray(schedule.braking)
    bend = 0.5 * (braking[1:] + braking[:-1])[owner]
    rise = (place * (1.0 - place) * durations[owner] ** 2)[:, None]
    course = temperature[owner] + place[:, None] * (temperature[owner + 1] - temperature[owner])
    padding = np.zeros(total - owner.size, dtype=int)

    def on_nodes(first: np.ndarray, values: np.ndarray) -> np.ndarray:
        values = np.concatenate([first[None], values])
        return np.concatenate([values, values[padding - 1]])

    def on_steps(values: np.ndarray) -> np.ndarray:
        values = np.asarray(values)[owner]
        return np.concatenate([values, np.broadcast_to(values[-1:], padding.shape)])

    fine = Schedule(
        time=on_nodes(node_time[0], node_time[owner] + place * durations[owner]),
        temperature=on_nodes(temperature[0], course + 0.5 * bend * rise),
        load=on_steps(schedule.load),
        applied=on_steps(schedule.applied),
        braking=np.zeros((total + 1, 2)),
    )
    return FineGrid(fine, np.maximum(last - counts // 2 - 1, 0), np.maximum(last - 1, 0))
