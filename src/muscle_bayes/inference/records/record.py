"""From a run's rows to the arrays that a solver and a likelihood work on."""

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Array, Float
from scipy.ndimage import maximum_filter1d
from scipy.signal import lfilter

from muscle_bayes.data.run import Run
from muscle_bayes.inference.records.regime import Regime, regime_of
from muscle_bayes.inference.records.rig import restores
from muscle_bayes.inference.records.thermometer import course, course_variance, deceleration
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
JOLT, POUR = 0.05, 10.0
"""Standard deviation of where a rotor comes to rest after a change of the load, in its way there, and how
near to each other jumps are parts of one change [s]."""
HAND, SWINGS = 0.1, 2.0
"""How exactly it is known when a load changed [s], and for how long the rotor swings after that [s]."""
AFTER_JUMP = 1e-3
"""Length of the interval in which the rotor slides after the load has jumped, s."""
JUMP, MOST_JUMPS = 0.1, 100
"""Share of its range by which a power jumps at a row, and how often before it is averaged instead."""
COOLING_TIMES, WARMED = (3.0, 10.0, 30.0, 100.0), 60.0
"""Of bodies whose temperature nodes follow where a power heats [s], and by how much it rises [C]."""
FIRST_SECONDS = 1.0
"""Readings of a slow run whose mean is where its rotor begins, s."""
CURVATURE_SPAN = 0.5
"""Instants this far apart tell how temperature bends, s."""
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
FROZEN_READINGS = 20
"""Identical readings in a row that tell of a sensor without noise; fewer come about by chance."""
SEGMENT = 0.25
"""Length of the segments into which a run is cut that nothing pulls back, s: short, so that the
forces of each moment count and not the position error that accumulates."""


class Record(NamedTuple):
    """One run, or one segment of it, on its grid. Arrays are NumPy until they are stacked."""

    schedule: Schedule
    time: Float[Array, " interval"]
    """When the averaged readings were taken [s after the run's first row]; of slow runs, the middle."""
    reading: Float[Array, " interval"]
    """Mean reading [the log's unit]."""
    weight: Float[Array, " interval"]
    """Number of independent readings in the mean; 0 where nothing is observed."""
    coarse: Float[Array, " interval"]
    """Variance of quantisation error in the mean, in squared quanta."""
    jolted: Float[Array, " interval"]
    """Variance that a jump of the load adds to the discrepancy [log's unit^2]."""
    start_reading: float
    """First reading of the record, of slow runs the mean of the first ones [the log's unit]."""
    start_speed: float
    """Slope of the first readings [log's unit per s]."""
    deceleration: Float[Array, "node 2"]
    """How heating or cooling of both sides slows down towards a turn [C/s^2]; 0 of fast runs."""
    heat_variance: Float[Array, "interval 2"]
    """Variance of the temperature of both sides [C^2]."""
    imposed: Float[Array, "interval 2"] | None = None
    """Mean coordinate [rad or m] and speed that are imposed; None where the plant moves by itself."""


def _means(values: np.ndarray, owner: np.ndarray, size: int) -> np.ndarray:
    """Mean of `values` for each owner 0..size-1; NaN where it owns none."""
    inside = (owner >= 0) & (owner < size)
    counts = np.bincount(owner[inside], minlength=size)
    sums = np.bincount(owner[inside], weights=values[inside], minlength=size)
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def _observations(
    run: Run, owner: np.ndarray, size: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Mean time, mean reading, weight and quantisation variance of each interval's readings.

    Readings that never change share one quantisation error, however many there are. So a mean of
    identical readings keeps the error of a single one, and of a stretch of FROZEN_READINGS or more
    only the middle interval counts.
    """
    time, reading = run.table["time"].to_numpy(), run.table["reading"].to_numpy()
    inside = (owner >= 0) & (owner < size)
    rows = pd.DataFrame({"reading": reading[inside]}).groupby(owner[inside])["reading"]
    low, high = (extreme.reindex(range(size)).to_numpy() for extreme in (rows.min(), rows.max()))
    weight = np.bincount(owner[inside], minlength=size).astype(float)
    frozen = (low == high) & (weight > 0)
    coarse = np.where(frozen, 1.0, 1.0 / np.maximum(weight, 1.0)) / 12.0
    mean_time, mean = _means(time, owner, size), _means(reading, owner, size)
    if run.output_sensor.resolution > 0.0:
        value = np.where(frozen, low, np.arange(size) + np.nan)
        stretch = np.cumsum(np.r_[True, ~(value[1:] == value[:-1])])
        for _, members in pd.Series(np.arange(size)).groupby(stretch):
            if frozen[members.iloc[0]] and weight[members].sum() >= FROZEN_READINGS:
                keep = members.iloc[len(members) // 2]
                weight[members[members != keep]] = 0.0
    return mean_time, np.where(weight > 0, mean, 0.0), weight, coarse


def _start(run: Run) -> tuple[float, float]:
    """First reading and initial slope, from the first tenth of a second (at least five rows)."""
    time, reading = run.table["time"].to_numpy(), run.table["reading"].to_numpy()
    rows = max(5, int(np.searchsorted(time, 0.1)))
    slope = np.polyfit(time[:rows], reading[:rows], 1)[0] if time.size > rows else 0.0
    return float(reading[0]), float(slope)


def heating(run: Run, side: str) -> np.ndarray | None:
    """What heats a side, in each row: its power, or what that is proportional to; None: a thermometer
    shows the temperature."""
    if not run.metadata.is_heated_by_power(side):
        return None
    logged = run.table[f"power_{side}"].to_numpy()
    return logged**2 if run.metadata.power_unit.kind in ("current", "voltage") else logged


def _is_held(run: Run, name: str) -> bool:
    """Whether a column's value holds until the next row; else it changes evenly to that of the next."""
    columns = run.metadata.columns
    return columns is not None and getattr(columns, f"{name}_held")


def _integral(values: np.ndarray, time: np.ndarray, held: bool) -> np.ndarray:
    """Integral of a column over time, up to each row."""
    between = values[:-1] if held else 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[0.0], np.cumsum(between * np.diff(time))])


def _heat_at(run: Run, side: str, nodes: np.ndarray) -> np.ndarray:
    """A side's temperature at the nodes [C]; of a side that power heats, that, its energy kept."""
    power, time = heating(run, side), run.table["time"].to_numpy()
    if power is None:
        return course(run.heat_time, run.table[f"temperature_{side}"].to_numpy(), nodes).value
    energy = _integral(power, time, _is_held(run, "power"))
    ends = np.concatenate([nodes[:1], 0.5 * (nodes[1:] + nodes[:-1]), nodes[-1:]])
    return np.diff(np.interp(ends, time, energy)) / np.diff(ends)


def _bend(run: Run, side: str, even: np.ndarray) -> np.ndarray:
    """Second derivative of a side's temperature at even times [C/s^2]."""
    power = heating(run, side)
    if power is None:
        logged = run.table[f"temperature_{side}"].to_numpy()
        return course(run.heat_time, logged, even).curvature
    # What heats turns into a temperature that is not known yet: of bodies that cool in such times.
    logged = np.interp(even, run.table["time"].to_numpy(), power)
    bends = []
    for cooling in COOLING_TIMES:
        share = 1.0 - np.exp(-(even[1] - even[0]) / cooling)
        warm = lfilter([share], [1.0, share - 1.0], logged)
        rate = np.gradient(warm, even) * WARMED / max(float(np.ptp(warm)), 1e-30)
        bends.append(np.abs(np.gradient(rate, even)))
    return np.max(bends, axis=0)


def _switched(run: Run) -> np.ndarray:
    """Rows after which the power of a heater jumps; none where it does so all the time, as PWM does."""
    found = np.zeros(0, int)
    for side in "ab":
        if (power := heating(run, side)) is not None:
            jumps = np.flatnonzero(np.abs(np.diff(power)) > JUMP * np.ptp(power))
            found = np.union1d(found, jumps) if jumps.size <= MOST_JUMPS else found
    return found


def _slow_nodes(run: Run) -> np.ndarray:
    """Nodes such that temperature is linear between them to TEMPERATURE_TOLERANCE.

    Over an interval h the chord misses a curve by |T''| h^2 / 8. So nodes crowd where heating starts
    or ends, where friction makes the rotor turn back, and are sparse while the muscle cools.
    """
    time = run.table["time"].to_numpy()
    shortest = max(SLOW_SHORTEST, float(np.median(np.diff(time))))
    even = np.linspace(0.0, run.duration, int(np.ceil(run.duration / CURVATURE_SPAN)) + 1)
    bend = np.zeros(even.size)
    for side in "ab":
        second = _bend(run, side, even)
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


def _changes(jumps: np.ndarray) -> list[np.ndarray]:
    """Times at which the load jumps [s], those of one change together."""
    return np.split(jumps, np.flatnonzero(np.diff(jumps) >= POUR) + 1) if jumps.size else []


def _jolted(nodes: np.ndarray, load: np.ndarray, mean: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Variance that jumps of the load add to the discrepancy in each interval [log's unit^2].

    A jolted rotor swings and comes to rest anywhere within friction's reach, by details that nobody
    logs, as how water was poured. There it stays until heat drives it on.
    """
    sizes = np.abs(np.diff(load, prepend=load[:1]))
    begins, ends = nodes[:-1], nodes[1:]
    jolted = np.zeros(load.size)
    for jumps in _changes(begins[sizes > 0.0]):
        before = np.flatnonzero(seen & (ends <= jumps[0]))
        after = np.flatnonzero(seen & (begins >= jumps[-1] + SWINGS))
        if before.size and after.size:
            parts = (begins >= jumps[0]) & (begins <= jumps[-1])
            moved = mean[after[0]] - mean[before[-1]]
            jolted[parts] = (JOLT * moved) ** 2 * sizes[parts] / sizes[parts].sum()
    return jolted


def _by_hand(run: Run) -> Float[np.ndarray, "change 2"]:
    """Spans in which a hand changes the load, and the rotor swings after that [s].

    Nobody logs how it did so, and when exactly: readings do not count there.
    """
    if run.metadata.load is None:
        return np.zeros((0, 2))
    jumps = np.array([jump for jump in run.load_steps if 0.0 < jump < run.duration])
    return np.array([(one[0] - HAND, one[-1] + SWINGS) for one in _changes(jumps)]).reshape(-1, 2)


def _slowing(run: Run, side: str, nodes: np.ndarray) -> np.ndarray:
    if heating(run, side) is not None:
        return np.zeros(nodes.size)
    return deceleration(run.heat_time, run.table[f"temperature_{side}"].to_numpy(), nodes)


def _heat_variance(run: Run, nodes: np.ndarray) -> Float[np.ndarray, "interval 2"]:
    """Variance of both sides' temperature in each interval; 0 of a side without a muscle."""
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    sides = []
    for side in "ab":
        values = run.table[f"temperature_{side}"].to_numpy()
        muscle = getattr(run.metadata, f"element_{side}").kind == "muscle"
        if muscle and heating(run, side) is None:
            sides.append(course_variance(run.heat_time, values, middles))
        else:
            sides.append(np.zeros(nodes.size - 1))
    return np.stack(sides, 1)


def slow_record(run: Run) -> Record:
    """Intervals that follow the temperature, cut where the load changes, readings averaged over each."""
    time = run.table["time"].to_numpy()
    nodes = _slow_nodes(run)
    jumps = np.array([jump for jump in run.load_steps if 0.0 < jump < run.duration])
    after = time[_switched(run) + 1]
    heats = (after, after + AFTER_JUMP) if _is_held(run, "power") else (time[_switched(run)], after)
    by_hand = _by_hand(run)
    spans = by_hand[(by_hand > 0.0) & (by_hand < run.duration)]
    nodes = np.unique(
        np.concatenate([nodes, jumps, jumps + AFTER_JUMP, spans, *heats, *_pauses(time)])
    )
    size = nodes.size - 1
    owner = np.clip(np.searchsorted(nodes, time, side="right") - 1, 0, size - 1)
    temperature = np.stack([_heat_at(run, side, nodes) for side in "ab"], 1)
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    load = run.table["load"].to_numpy()[np.searchsorted(time, middles, side="right") - 1]
    applied = _means(run.table["applied"].to_numpy(), owner, size)
    applied = np.interp(middles, middles[np.isfinite(applied)], applied[np.isfinite(applied)])
    mean_time, mean, weight, coarse = _observations(run, owner, size)
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
        jolted=_jolted(nodes, load, mean, weight > 0),
        start_reading=first,
        start_speed=0.0,
        deceleration=slowing,
        heat_variance=_heat_variance(run, nodes),
    )


IMPOSED_INTERVALS = 1400
"""Most intervals into which a run of imposed motion is divided."""


def imposed_record(run: Run) -> Record:
    """Rows, or as many of them as make IMPOSED_INTERVALS bins, averaged: forces and coordinates alike.

    A mean force is that of the mean coordinate and speed, to first order, however quickly they change.
    """
    time = run.table["time"].to_numpy()
    per_bin, rows = -(-time.size // IMPOSED_INTERVALS), np.arange(time.size)
    about = _switched(run)[:, None] + np.arange(3)  # a row before and a row after each jump
    begins = np.union1d(rows[::per_bin], about[about < time.size])
    owner = np.searchsorted(begins, rows, side="right") - 1
    size = int(owner[-1]) + 1
    mean_time, mean, weight, coarse = _observations(run, owner, size)
    edge = np.flatnonzero(np.diff(owner))
    step = 0.5 * np.diff(time)
    nodes = np.r_[time[0] - step[0], 0.5 * (time[edge] + time[edge + 1]), time[-1] + step[-1]]
    q = run.coordinate
    slopes = np.gradient(q, time)
    ends = np.interp(nodes, time, q)
    ends[0], ends[-1] = q[0] - step[0] * slopes[0], q[-1] + step[-1] * slopes[-1]
    heat = np.stack([_heat_at(run, side, nodes) for side in "ab"], 1)
    nothing = np.zeros(size)
    return Record(
        Schedule(nodes, heat, nothing, nothing),
        mean_time,
        mean,
        weight,
        coarse,
        nothing,
        float(mean[weight > 0][0]),
        0.0,
        np.zeros((nodes.size, 2)),
        _heat_variance(run, nodes),
        np.stack([_means(q, owner, size), np.diff(ends) / np.diff(nodes)], 1),
    )


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
    mean_time, mean, weight, coarse = _observations(run, owner, size)
    scatter = _means((time - mean_time[owner]) ** 2, owner, size)
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
    impulse = _integral(applied, time, _is_held(run, "applied"))
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


def record_of(run: Run) -> Record:
    """The run on the grid that its regime asks for."""
    return _RECORDS[regime_of(run)](run)


_RECORDS: dict[Regime, Callable[[Run], Record]] = {
    "fast": fast_record,
    "slow": slow_record,
    "imposed": imposed_record,
    "heated": imposed_record,
}
