"""What a heater's duty was: as logged, else where the law leaves no doubt that it is nothing or full."""

from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from jaxtyping import Float

from muscle_bayes.bench.heat.temperature_control import FULL_DUTY, HeaterLaw
from muscle_bayes.data.run import Run

SHORTEST: Final = 8.0
"""Shortest stretch that is used [s]."""
FEWEST: Final = 12
"""Fewest fresh readings of a stretch."""
MOST: Final = 1500
"""Readings of a stretch that are used, evenly chosen: a tube is slow."""
STEP: Final = 0.1
"""Between the instants at which a duty is told [s]."""
FORGOTTEN: Final = 3.0
"""Time after which it matters no more by what power a logged stretch began [s]."""


class Stretch(NamedTuple):
    """A time in which the duty is known."""

    duty: Float[np.ndarray, " instant"]
    """From instant to instant, STEP apart, as a share of the full one."""
    time: Float[np.ndarray, " reading"]
    """s after the stretch's start"""
    temperature: Float[np.ndarray, " reading"]
    """C"""
    timing: Float[np.ndarray, " reading"]
    """Standard deviation of a reading for not knowing when, since the row before, it was taken [C]."""
    room: float
    """Room temperature that the metadata state [C]."""


def certain_duty(setpoint: np.ndarray, temperature: np.ndarray, law: HeaterLaw) -> np.ndarray:
    """0 or 1 where the law's duty is zero or full whatever its integral may be, NaN elsewhere.

    For logs of setpoint and temperature without duty. The integral depends on what was before the
    log, but it is clamped: far from the setpoint it cannot matter. A channel without setpoint is off.
    """
    error = setpoint - temperature
    known = law.constant + law.feedforward * setpoint + law.proportional * error
    reach = law.integral * law.integral_limit
    least, most = law.gain * (known - reach), law.gain * (known + reach)
    certain = np.where(least >= FULL_DUTY, 1.0, np.where(most <= 0.0, 0.0, np.nan))
    return np.where(np.isnan(setpoint), 0.0, certain)


def stretches(run: Run, law: HeaterLaw) -> list[Stretch]:
    """Every stretch of known duty, of both channels: where it is logged, else where the law is certain."""
    found = []
    for side in "ab":
        reading = run.table[f"temperature_{side}"].to_numpy()
        if np.ptp(reading) < 5.0:
            continue
        logged = run.table.get(f"duty_{side}")
        known = logged is not None and bool(logged.notna().any())
        found += _logged(run, side) if known else _certain(run, side, law)
    return found


def _logged(run: Run, side: str) -> list[Stretch]:
    """From one gap of rows or duties to the next, whatever the duty was."""
    time, duty = (run.table[name].to_numpy() for name in ("time", f"duty_{side}"))
    reading = run.table[f"temperature_{side}"].to_numpy()
    room = run.metadata.fixture.room_temperature
    known = np.isfinite(duty)
    breaks = (np.diff(time) > 2.0) | (known[1:] != known[:-1])
    found = []
    for first, end in pairwise([0, *(np.flatnonzero(breaks) + 1), time.size]):
        rows = slice(first, end)
        if not known[first] or time[end - 1] - time[first] < SHORTEST:
            continue
        instants = np.arange(time[first], time[end - 1] + STEP, STEP)
        # Somewhere between two rows a duty changed; on average halfway.
        share = np.interp(instants + 0.5 * STEP, time[rows], duty[rows]) / FULL_DUTY
        one = _fresh(time[rows], reading[rows], share, room)
        late = one.time >= FORGOTTEN
        one = one._replace(**{k: getattr(one, k)[late] for k in ("time", "temperature", "timing")})
        if one.time.size >= FEWEST:
            found.append(one)
    return found


def _certain(run: Run, side: str, law: HeaterLaw) -> list[Stretch]:
    """Those that begin with a new setpoint: until then the temperature was held, which tells the power
    with which the stretch begins."""
    time = run.table["time"].to_numpy()
    reading = run.table[f"temperature_{side}"].to_numpy()
    room = run.metadata.fixture.room_temperature
    setpoint = run.table[f"setpoint_{side}"].to_numpy()
    duty = certain_duty(setpoint, reading, law)
    gaps = np.diff(time, prepend=time[0]) > 2.0
    changes = (duty[1:] != duty[:-1]) & ~(np.isnan(duty[1:]) & np.isnan(duty[:-1]))
    starts = np.flatnonzero(np.concatenate([[True], changes | gaps[1:]]))
    found = []
    for first, end in pairwise([*starts, time.size]):
        rows = slice(first, end)
        # A channel that idles at room temperature tells nothing.
        idle = np.ptp(reading[rows]) < 3.0
        held = first > 0 and setpoint[first] != setpoint[first - 1] and not gaps[first]
        short = time[end - 1] - time[first] < SHORTEST
        if np.isnan(duty[first]) or idle or short or not held:
            continue
        count = int((time[end - 1] - time[first]) / STEP) + 2
        one = _fresh(time[rows], reading[rows], np.full(count, duty[first]), room)
        if one.time.size >= FEWEST:
            found.append(one)
    return found


def _fresh(time: np.ndarray, reading: np.ndarray, duty: np.ndarray, room: float) -> Stretch:
    """Readings that differ from the row before: the meter has just taken them."""
    fresh = np.flatnonzero(np.diff(reading) != 0.0) + 1
    # The first may have been taken before the setpoint changed.
    fresh = fresh[1:]
    fresh = fresh[:: max(-(-fresh.size // MOST), 1)]
    gap = time[fresh] - time[fresh - 1]
    since, value = time[fresh] - 0.5 * gap - time[0], reading[fresh]
    slope = np.gradient(value, since) if fresh.size > 1 else np.zeros(fresh.size)
    return Stretch(duty, since, value, np.abs(slope) * gap / np.sqrt(12.0), room)
