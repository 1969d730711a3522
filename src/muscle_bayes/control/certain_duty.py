"""Where a heater's duty is surely nothing or full: as logged, else where the law leaves no doubt."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from muscle_bayes.bench.heat.temperature_control import FULL_DUTY, HeaterLaw
from muscle_bayes.data.run import Run

SHORTEST = 8.0
"""Shortest stretch that is used [s]."""
FEWEST = 12
"""Fewest fresh readings of a stretch."""


LATE = 0.5
"""Time within which the board's duty is logged after a new setpoint [s]."""


class Stretch(NamedTuple):
    """A time in which the duty is surely nothing, or surely full."""

    full: bool
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


def logged_duty(duty: np.ndarray, setpoint: np.ndarray, time: np.ndarray) -> np.ndarray:
    """0 or 1 where a log has no duty or full duty, NaN where it has another or none.

    A row holds the duty that the board said last, so one that follows a new setpoint within LATE is
    taken to have begun with it.
    """
    certain = np.where(duty == FULL_DUTY, 1.0, np.where(duty == 0.0, 0.0, np.nan))
    for at in np.flatnonzero(setpoint[1:] != setpoint[:-1]) + 1:
        end = int(np.searchsorted(time, time[at] + LATE, side="right"))
        new = np.flatnonzero(np.isfinite(certain[at:end]) & (duty[at:end] != duty[at - 1]))
        if new.size:
            certain[at : at + new[0]] = certain[at + new[0]]
    return certain


def _duty(run: Run, side: str, law: HeaterLaw) -> np.ndarray:
    """0 or 1 where the duty of a side is sure, NaN elsewhere."""
    setpoint = run.table[f"setpoint_{side}"].to_numpy()
    logged = run.table.get(f"duty_{side}")
    if logged is not None and logged.notna().any():
        return logged_duty(logged.to_numpy(), setpoint, run.table["time"].to_numpy())
    return certain_duty(setpoint, run.table[f"temperature_{side}"].to_numpy(), law)


def stretches(run: Run, law: HeaterLaw) -> list[Stretch]:
    """Every stretch of certain duty that begins with a new setpoint, of both channels.

    Until then the temperature was held, which tells the power with which the stretch begins.
    """
    time = run.table["time"].to_numpy()
    gaps = np.diff(time, prepend=time[0]) > 2.0
    room = run.metadata.fixture.room_temperature
    found = []
    for side in "ab":
        reading = run.table[f"temperature_{side}"].to_numpy()
        if np.ptp(reading) < 5.0:
            continue
        setpoint = run.table[f"setpoint_{side}"].to_numpy()
        duty = _duty(run, side, law)
        changes = (duty[1:] != duty[:-1]) & ~(np.isnan(duty[1:]) & np.isnan(duty[:-1]))
        starts = np.flatnonzero(np.concatenate([[True], changes | gaps[1:]]))
        for first, end in pairwise([*starts, time.size]):
            rows = slice(first, end)
            # A channel that idles at room temperature tells nothing.
            idle = np.ptp(reading[rows]) < 3.0
            held = first > 0 and setpoint[first] != setpoint[first - 1] and not gaps[first]
            short = time[end - 1] - time[first] < SHORTEST
            if np.isnan(duty[first]) or idle or short or not held:
                continue
            one = _fresh(time[rows], reading[rows], duty[first] == 1.0, room)
            if one.time.size >= FEWEST:
                found.append(one)
    return found


def _fresh(time: np.ndarray, reading: np.ndarray, full: bool, room: float) -> Stretch:
    """Readings that differ from the row before: the meter has just taken them."""
    fresh = np.flatnonzero(np.diff(reading) != 0.0) + 1
    # The first may have been taken before the setpoint changed.
    fresh = fresh[1:]
    gap = time[fresh] - time[fresh - 1]
    since, value = time[fresh] - 0.5 * gap - time[0], reading[fresh]
    slope = np.gradient(value, since) if fresh.size > 1 else np.zeros(fresh.size)
    return Stretch(full, since, value, np.abs(slope) * gap / np.sqrt(12.0), room)
