"""Where a log tells the heater's duty, though it has no column for it."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from muscle_bayes.bench.temperature_control import FULL_DUTY, HeaterLaw
from muscle_bayes.data.run import Run

SHORTEST = 8.0
"""Shortest stretch that is used [s]."""
FEWEST = 12
"""Fewest fresh readings of a stretch."""


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

    Runs log setpoint and temperature, no duty. The integral depends on what was before the log, but it
    is clamped: far from the setpoint it cannot matter. A channel without setpoint is off.
    """
    error = setpoint - temperature
    known = law.constant + law.feedforward * setpoint + law.proportional * error
    reach = law.integral * law.integral_limit
    least, most = law.gain * (known - reach), law.gain * (known + reach)
    certain = np.where(least >= FULL_DUTY, 1.0, np.where(most <= 0.0, 0.0, np.nan))
    return np.where(np.isnan(setpoint), 0.0, certain)


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
        duty = certain_duty(setpoint, reading, law)
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
