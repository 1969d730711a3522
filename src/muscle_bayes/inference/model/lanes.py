"""Runs of one kind, side by side."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Array, Float, Int

from muscle_bayes.data.run import Run
from muscle_bayes.inference.model import prior
from muscle_bayes.inference.records.parts import heaters_of
from muscle_bayes.inference.records.record import Record
from muscle_bayes.inference.records.rig import output_of, rig
from muscle_bayes.physics.heater import Heater
from muscle_bayes.physics.outputs import Output
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.refinement import FineGrid
from muscle_bayes.physics.schedule import Schedule

LEAST_SIZE = 64
"""Intervals of the shortest lanes."""


class Lanes(NamedTuple):
    """Runs (or segments) of one regime and one plant structure, stacked along a leading axis."""

    plant: Plant
    heaters: tuple[Heater, Heater]
    """What says the temperatures of sides A and B from what the schedule holds of them."""
    output: Output
    """What the readings are of."""
    schedule: Schedule
    time: Float[Array, "lane interval"]
    reading: Float[Array, "lane interval"]
    weight: Float[Array, "lane interval"]
    coarse: Float[Array, "lane interval"]
    jolted: Float[Array, "lane interval"]
    """Variance that a jump of the load adds to the discrepancy [log's unit^2]."""
    scale: Float[Array, " lane"]
    """Measured quantity [SI] per unit of reading, with sign."""
    quantum: Float[Array, " lane"]
    """Resolution of the sensor [log's unit]."""
    run: Int[Array, " lane"]
    """Index of the lane's run among those of its regime that have unknowns of their own."""
    released: Float[Array, " lane"]
    """1 where the record starts at rest by protocol, 0 where its first speed is unknown."""
    start: Float[Array, "lane 2"]
    """Prior means of the first reading and speed [log's unit, per s]; used by segments only."""
    tension: Float[Array, " lane"]
    """Tension with whose rest HYST begins, but for a lag: the first that was read, else the typical [N]."""
    start_spread: Float[Array, "lane 2"]
    """Their standard deviations."""
    pivot: Float[Array, "lane 2"]
    """First reading and speed about which the response to them is taken for linear."""
    heat_variance: Float[Array, "lane interval 2"]
    """Variance of the temperature of both sides [C^2]."""
    thermal: Float[Array, "lane interval"]
    """What that adds to the variance of the discrepancy at the mode [log's unit^2]."""
    swing: Float[Array, "lane interval"]
    """What inertia adds to slow motion at the mode [log's unit]; 0 where it is not left out."""
    deceleration: Float[Array, "lane node 2"]
    """How temperature slows down towards a turn [C/s^2]: between nodes it is no straight line."""
    fine: FineGrid | None = None
    """Steps that follow the rotor's swings, of slow runs that need inertia; else None."""
    imposed: Float[Array, "lane interval 2"] | None = None
    """Mean coordinate [rad or m] and speed that are imposed; None where the plant moves by itself."""
    again: Float[Array, "lane interval"] | None = None
    """Readings of a second record from the same start; None if there is only one."""


def padded_size(intervals: int) -> int:
    """Length to which lanes of so many intervals are padded: LEAST_SIZE, or 5, 6, 7 or 8 eighths of a power
    of 2. Similar data sets then share compiled code."""
    power = 1 << (intervals - 1).bit_length()
    return max(
        LEAST_SIZE, min(part * power // 8 for part in (5, 6, 7, 8) if part * power >= 8 * intervals)
    )


def _pad(record: Record, size: int) -> Record:
    """The record lengthened to `size` intervals by intervals of no duration and no readings."""
    missing = size - record.time.size

    def last(values: np.ndarray) -> np.ndarray:
        return np.concatenate([values, np.repeat(values[-1:], missing, axis=0)])

    def zeros(values: np.ndarray) -> np.ndarray:
        return np.concatenate([values, np.zeros(missing)])

    return record._replace(
        schedule=jax.tree.map(last, record.schedule),
        time=last(record.time),
        reading=zeros(record.reading),
        weight=zeros(record.weight),
        coarse=zeros(record.coarse),
        jolted=zeros(record.jolted),
        deceleration=last(record.deceleration),
        heat_variance=last(record.heat_variance),
        imposed=None if record.imposed is None else last(record.imposed),
    )


def _imposed(records: Sequence[Record]) -> np.ndarray | None:
    courses = [record.imposed for record in records if record.imposed is not None]
    return np.stack(courses) if courses else None


def stacked_lanes(
    runs: Sequence[Run], records: Sequence[Record], index: Sequence[int], typical: float
) -> Lanes:
    """Runs of one kind and their records as lanes, padded to one length.

    `index` counts those that have unknowns of their own; `typical` is a tension [N] where none was read.
    """
    longest = max(record.time.size for record in records)
    size = padded_size(longest)
    padded = [_pad(record, size) for record in records]
    plants = [rig(run.metadata) for run in runs]
    level = np.array([prior.reading_noise(run) for run in runs])
    quick = np.array([record.start_speed for record in records])

    def stacked(*trees):
        return jax.tree.map(
            lambda *leaves: np.stack([np.asarray(x, float) for x in leaves]), *trees
        )

    start = np.array([[record.start_reading, record.start_speed] for record in records])
    return Lanes(
        plant=stacked(*plants),
        heaters=stacked(*(heaters_of(run.metadata) for run in runs)),
        output=output_of(runs[0]),
        schedule=stacked(*(record.schedule for record in padded)),
        time=np.stack([record.time for record in padded]),
        reading=np.stack([record.reading for record in padded]),
        weight=np.stack([record.weight for record in padded]),
        coarse=np.stack([record.coarse for record in padded]),
        jolted=np.stack([record.jolted for record in padded]),
        scale=np.array([run.output_sensor.sign * run.output_sensor.scale for run in runs]),
        quantum=np.array([run.output_sensor.resolution for run in runs]),
        run=np.asarray(index, dtype=np.int32),
        released=np.array([float(run.metadata.protocol == "spring") for run in runs]),
        start=start,
        tension=np.array([prior.first_tension(run) or typical for run in runs]),
        start_spread=np.stack([20.0 * level, 20.0 * level / 0.05 + 0.2 * np.abs(quick)], 1),
        pivot=start,
        heat_variance=np.stack([record.heat_variance for record in padded]),
        thermal=np.zeros((len(padded), size)),
        swing=np.zeros((len(padded), size)),
        deceleration=np.stack([record.deceleration for record in padded]),
        imposed=_imposed(padded),
    )
