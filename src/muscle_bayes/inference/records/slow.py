"""Runs that follow a temperature, on intervals of seconds."""

import numpy as np
from scipy.ndimage import maximum_filter1d

from muscle_bayes.data.run import Run
from muscle_bayes.inference.records.averages import means, observations
from muscle_bayes.inference.records.heat import (
    bend_of_heat,
    heat_at,
    heat_variance,
    heating,
    is_held,
    switched,
)
from muscle_bayes.inference.records.load_changes import by_hand_spans, jolted_by
from muscle_bayes.inference.records.record import Record
from muscle_bayes.inference.records.thermometer import deceleration
from muscle_bayes.physics.schedule import Schedule

SLOW_INTERVALS = 700
"""Most intervals into which a slow run is divided for its temperature's sake."""
TEMPERATURE_TOLERANCE = 0.02
"""Error of temperature between nodes that the intervals of a slow run aim at, C."""
SLOW_LONGEST = 4.0
"""Longest interval of a slow run, s."""
SLOW_SHORTEST = 0.25
"""Shortest interval of a slow run, s."""
PAUSE = 3.0
"""Rows farther apart than this many usual distances have a gap between them."""
AFTER_JUMP = 1e-3
"""Length of the interval in which the rotor slides after the load has jumped, s."""
FIRST_SECONDS = 1.0
"""Readings of a slow run whose mean is where its rotor begins, s."""
CURVATURE_SPAN = 0.5
"""Instants this far apart tell how temperature bends, s."""


def _nodes(run: Run) -> np.ndarray:
    """Nodes such that temperature is linear between them to TEMPERATURE_TOLERANCE.

    Over an interval h the chord misses a curve by |T''| h^2 / 8. So nodes crowd where heating starts
    or ends, where friction makes the rotor turn back, and are sparse while the muscle cools.
    """
    time = run.table["time"].to_numpy()
    shortest = max(SLOW_SHORTEST, float(np.median(np.diff(time))))
    even = np.linspace(0.0, run.duration, int(np.ceil(run.duration / CURVATURE_SPAN)) + 1)
    bend = np.zeros(even.size)
    for side in "ab":
        second = bend_of_heat(run, side, even)
        # A bend is felt before and after the point at which it is measured.
        bend = np.maximum(bend, maximum_filter1d(np.abs(second), 5))
    wanted = np.sqrt(8.0 * TEMPERATURE_TOLERANCE / np.maximum(bend, 1e-12))
    per_second = 1.0 / np.clip(wanted, shortest, SLOW_LONGEST)
    count = np.concatenate([[0.0], np.cumsum(0.5 * (per_second[1:] + per_second[:-1]))])
    count *= even[1] - even[0]
    size = int(min(np.ceil(count[-1]), max(SLOW_INTERVALS, run.duration / SLOW_LONGEST)))
    return np.interp(np.linspace(0.0, count[-1], size + 1), count, even)


def _pauses(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the log's gaps: an interval of which only a part was logged has no mean."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    long = np.flatnonzero(steps > max(PAUSE * usual, SLOW_SHORTEST))
    return time[long] + 0.5 * usual, time[long + 1] - 0.5 * usual


def _centred(
    mean_time: np.ndarray,
    mean: np.ndarray,
    weight: np.ndarray,
    coarse: np.ndarray,
    middles: np.ndarray,
) -> np.ndarray:
    """Mean readings as they would be had the rows lain evenly about each interval's middle.

    An interval holds few rows, and their mean time is off its middle by a part of a row: moved by
    the slope to the neighbouring mean to which it is less steep, for a jump of the rotor is no slope.
    Readings that never change have none.
    """
    told = np.flatnonzero(weight > 0)
    if told.size < 3:
        return mean
    steps = np.diff(mean[told]) / np.diff(mean_time[told])
    before, after = np.r_[steps[0], steps], np.r_[steps, steps[-1]]
    smaller = np.sign(before) * np.minimum(np.abs(before), np.abs(after))
    slope = np.where(before * after > 0.0, smaller, 0.0)
    moves = (coarse[told] < 1.0 / 12.0) | (weight[told] <= 1.0)
    moved = mean.copy()
    moved[told] -= np.where(moves, slope * (mean_time[told] - middles[told]), 0.0)
    return moved


def _slowing(run: Run, side: str, nodes: np.ndarray) -> np.ndarray:
    if heating(run, side) is not None:
        return np.zeros(nodes.size)
    return deceleration(run.heat_time, run.table[f"temperature_{side}"].to_numpy(), nodes)


def slow_record(run: Run) -> Record:
    """Intervals that follow the temperature, cut where the load changes, readings averaged over each."""
    time = run.table["time"].to_numpy()
    nodes = _nodes(run)
    jumps = np.array([jump for jump in run.load_steps if 0.0 < jump < run.duration])
    after = time[switched(run) + 1]
    heats = (after, after + AFTER_JUMP) if is_held(run, "power") else (time[switched(run)], after)
    by_hand = by_hand_spans(run)
    spans = by_hand[(by_hand > 0.0) & (by_hand < run.duration)]
    nodes = np.unique(
        np.concatenate([nodes, jumps, jumps + AFTER_JUMP, spans, *heats, *_pauses(time)])
    )
    size = nodes.size - 1
    owner = np.clip(np.searchsorted(nodes, time, side="right") - 1, 0, size - 1)
    temperature = np.stack([heat_at(run, side, nodes) for side in "ab"], 1)
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    load = run.table["load"].to_numpy()[np.searchsorted(time, middles, side="right") - 1]
    applied = means(run.table["applied"].to_numpy(), owner, size)
    applied = np.interp(middles, middles[np.isfinite(applied)], applied[np.isfinite(applied)])
    mean_time, mean, weight, coarse = observations(run, owner, size)
    mean = _centred(mean_time, mean, weight, coarse, middles)
    for begin, end in by_hand:
        weight = np.where((middles > begin) & (middles < end), 0.0, weight)
    schedule = Schedule(nodes, temperature, load, applied)
    slowing = np.stack([_slowing(run, side, nodes) for side in "ab"], 1)
    begin = run.table["reading"].to_numpy()[time <= time[0] + FIRST_SECONDS]
    first = float(begin.mean())
    return Record(
        schedule,
        time=middles,
        reading=mean,
        weight=weight,
        coarse=coarse,
        jolted=jolted_by(nodes, load, mean, weight > 0),
        start_reading=first,
        start_speed=0.0,
        deceleration=slowing,
        heat_variance=heat_variance(run, nodes),
    )
