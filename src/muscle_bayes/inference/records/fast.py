"""Runs that swing or slide, and segments of those that nothing pulls back."""

from itertools import pairwise

import numpy as np

from muscle_bayes.data.run import Run
from muscle_bayes.inference.records.averages import means, observations
from muscle_bayes.inference.records.heat import integral, is_held
from muscle_bayes.inference.records.record import Record
from muscle_bayes.inference.records.regime import regime_of
from muscle_bayes.inference.records.rig import restores
from muscle_bayes.inference.records.slow import PAUSE
from muscle_bayes.physics.schedule import Schedule

FAST_BIN = 1 / 60
"""Readings closer than this are averaged in fast runs, s, or fewer where they swing fast (`_thirtieth`)."""
FORCED_BIN = 1 / 200
"""The same where an applied force is logged, which may change quickly, s."""
BENT = 1.8e-3
"""Averaging may cut off this share of the readings' spread: a swing is averaged over a thirtieth of its
period at most, and the solver's steps follow it."""
SOLVED = 0.1
"""Error that the solver's steps may add up to over a run, in standard deviations of a reading's noise."""
FINEST = 0.25
"""Shortest step that this asks for, in that thirtieth."""
REMEMBERED = 100.0
"""Radians of a swing after which damping or friction has forgotten such errors."""
FEWEST_BINS = 8
"""Of a fast run that is averaged: fewer do not tell how readings bend."""
FAST_LONGEST = 3.0
"""Longest interval of a fast run, in these: a gap of the log is solved in as many as it takes."""
SEGMENT = 0.25
"""Length of the segments into which a run is cut that nothing pulls back, s: short, so that the
forces of each moment count and not the position error that accumulates."""


def _start(run: Run) -> tuple[float, float]:
    """First reading and initial slope, from the first tenth of a second (at least five rows)."""
    time, reading = run.table["time"].to_numpy(), run.table["reading"].to_numpy()
    rows = max(5, int(np.searchsorted(time, 0.1)))
    slope = np.polyfit(time[:rows], reading[:rows], 1)[0] if time.size > rows else 0.0
    return float(reading[0]), float(slope)


def _bridges(nodes: np.ndarray, longest: float) -> np.ndarray:
    """Nodes inside gaps, `longest` apart at most: the rotor swings on there."""
    parts = [
        np.linspace(begin, end, int(np.ceil((end - begin) / longest)) + 1)[1:-1]
        for begin, end in pairwise(nodes)
        if end - begin > longest
    ]
    return np.concatenate([np.zeros(0), *parts])


def _second(time: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """Second derivative of means, by their neighbours; 0 at ends and gaps."""
    if mean.size < 3:
        return np.zeros(mean.size)
    steps = np.diff(time)
    reach = steps[1:] + steps[:-1]
    second = 2.0 * np.diff(np.diff(mean) / steps) / reach
    second[reach > 2.0 * PAUSE * np.median(steps)] = 0.0
    return np.concatenate([[0.0], second, [0.0]])


def _solved_step(longest: float, swing: float, duration: float, noise: float) -> float:
    """The longest step with which a swing [rad/s] is solved to SOLVED of the noise, a share of its spread.

    A fourth-order step h shifts the phase by (swing h)^5 / 120, and the run's steps add up.
    """
    radians = min(swing * duration, REMEMBERED)
    allowed = (120.0 * SOLVED * noise / (np.sqrt(2.0) * radians)) ** 0.25 / swing
    return float(np.clip(allowed, FINEST * longest, longest))


def _thirtieth(run: Run) -> float:
    """Time h over which readings bend by BENT of their spread: a thirtieth of a swing's period [s].

    q'' h^2 / 24 is what averaging over h cuts off; less where sensors are so good that the solver's own
    error would show. q'' from means of so many rows that noise, known
    from third differences, does not make most of it; endless where it always does.
    """
    time, reading = run.table["time"].to_numpy(), run.table["reading"].to_numpy()
    rows, spread = 1, float(reading.std())
    noise = 0.3 * run.output_sensor.resolution
    if reading.size > 3:
        scatter = 1.4826 * float(np.median(np.abs(np.diff(reading, 3)))) / np.sqrt(20.0)
        noise = max(noise, scatter)
    while reading.size // rows >= FEWEST_BINS and spread > 0.0:
        times, means = (
            values[: values.size // rows * rows].reshape(-1, rows).mean(1)
            for values in (time, reading)
        )
        steps = np.diff(times)
        usual = float(np.median(steps))
        even = np.minimum(steps[1:], steps[:-1]) > 0.5 * usual
        bend = float(np.mean(_second(times, means)[1:-1][even] ** 2)) if even.any() else 0.0
        own = 6.0 * noise**2 / rows / usual**4
        if bend > 2.0 * own:
            swing = float(np.sqrt(np.sqrt(bend - own) / spread))
            return _solved_step(np.sqrt(24.0 * BENT) / swing, swing, run.duration, noise / spread)
        rows *= 2
    return np.inf


def fast_record(run: Run) -> Record:
    """Nodes at the (averaged) times of the readings, cut where the load changes, in gaps more."""
    time = run.table["time"].to_numpy()
    applied = run.table["applied"].to_numpy()
    width = FORCED_BIN if np.any(applied != 0.0) else FAST_BIN
    usual, short = float(np.median(np.diff(time))), _thirtieth(run)
    per_bin = max(1, min(int(min(width, short) / usual), time.size // FEWEST_BINS))
    # The first row is a bin of its own: spring runs are released there.
    owner = (np.arange(time.size) + per_bin - 1) // per_bin
    size = int(owner[-1]) + 1
    mean_time, mean, weight, coarse = observations(run, owner, size)
    scatter = means((time - mean_time[owner]) ** 2, owner, size)
    seen = weight > 0  # and its neighbours, from which a bend is told
    seen[1:-1] &= (weight[2:] > 0) & (weight[:-2] > 0)
    mean = mean - np.where(seen, 0.5 * scatter * _second(mean_time, mean), 0.0)
    jumps = np.array([jump for jump in run.load_steps if 0.0 < jump < run.duration])
    own = np.union1d(mean_time, jumps)
    added = np.setdiff1d(
        np.union1d(own, _bridges(own, min(FAST_LONGEST * width, max(1.5 * short, 0.1 * usual)))),
        mean_time,
    )
    order = np.argsort(np.concatenate([mean_time, added]), kind="stable")

    def merged(values: np.ndarray, fill: float) -> np.ndarray:
        return np.concatenate([values, np.full(added.size, fill)])[order]

    nodes = np.concatenate([mean_time, added])[order]
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    load = run.table["load"].to_numpy()[np.searchsorted(time, middles, side="right") - 1]
    # Each interval sees the mean of the force logged from one node to the next: its impulse.
    impulse = integral(applied, time, is_held(run, "applied"))
    force = np.diff(np.interp(nodes, time, impulse)) / np.diff(nodes)
    temperature = np.stack(
        [np.interp(nodes, run.heat_time, run.table[f"temperature_{side}"]) for side in "ab"], 1
    )
    schedule = Schedule(nodes, temperature, load, force)
    first, slope = _start(run)
    return Record(
        schedule,
        time=nodes[1:],
        reading=merged(mean, 0.0)[1:],
        weight=merged(weight, 0.0)[1:],
        coarse=merged(coarse, 0.0)[1:],
        jolted=np.zeros(nodes.size - 1),
        start_reading=first,
        start_speed=slope,
        deceleration=np.zeros_like(temperature),
        heat_variance=np.zeros((nodes.size - 1, 2)),
    )


def segments(run: Run, record: Record) -> list[Record]:
    """The record cut into pieces of SEGMENT s, each with its own start, if nothing restores."""
    if regime_of(run) != "fast" or restores(run) or run.measured != "position":
        return [record]
    nodes = record.schedule.time
    pieces = max(1, round(float(nodes[-1] - nodes[0]) / SEGMENT))
    cuts = [int(cut) for cut in np.linspace(0, nodes.size - 1, pieces + 1)]
    # A reading that is shown again and again counts once, but it is what is shown.
    last_seen = np.maximum.accumulate(np.where(record.weight > 0, np.arange(record.time.size), 0))
    shown = record.reading[last_seen]
    result = []
    for first, last in pairwise(cuts):
        steps, around = slice(first, last), slice(first, last + 1)
        schedule = Schedule(
            nodes[around],
            record.schedule.temperature[around],
            record.schedule.load[steps],
            record.schedule.applied[steps],
        )
        time, reading = record.time[steps], record.reading[steps]
        weight, coarse = record.weight[steps], record.coarse[steps]
        jolted = record.jolted[steps]
        near = slice(first, min(first + 8, last))
        slope, value = np.polyfit(record.time[near] - nodes[first], shown[near], 1)
        start = float(value), float(slope)
        slowing = record.deceleration[around]
        unsure = record.heat_variance[steps]
        parts = schedule, time, reading, weight, coarse, jolted, *start, slowing, unsure
        result.append(Record(*parts))
    return result
