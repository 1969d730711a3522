"""How the heaters met their setpoints, from the log of a run."""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from muscle_bayes.bench.heat.temperature_control import STABLE_BAND, STABLE_TIME
from muscle_bayes.data import Run

Floats = NDArray[np.float64]
_END: Final = 5.0
"""Span at the end of a setpoint over which the remaining error is averaged, s."""


@dataclass(frozen=True)
class Settling:
    """One setpoint of one side. Temperatures in C, times in s."""

    side: Literal["a", "b"]
    start: float
    """s after the first row"""
    setpoint: float
    step: float
    """setpoint less the temperature at its start"""
    settled: bool
    """stayed within the band for STABLE_TIME"""
    settling_time: float
    """s until it entered the band to stay for so long; NaN where it never did"""
    overshoot: float
    """farthest beyond the setpoint, in the direction of the step; 0 if never"""
    error: float
    """mean of temperature less setpoint over the last 5 s"""
    longest_error: float
    """largest distance from the setpoint after that"""


def settlings(run: Run) -> list[Settling]:
    """Every setpoint of a run, sides one after the other, in the order of time."""
    time = run.table["time"].to_numpy()
    found = []
    sides: tuple[Literal["a", "b"], ...] = ("a", "b")
    for side in sides:
        setpoint = run.table[f"setpoint_{side}"].to_numpy()
        temperature = run.table[f"temperature_{side}"].to_numpy()
        edges = np.flatnonzero(np.diff(setpoint)) + 1
        for part in np.split(np.arange(time.size), edges):
            wanted = float(setpoint[part[0]])
            if np.isfinite(wanted) and wanted > 0.0 and part.size > 1:
                found.append(_settling(side, time[part], temperature[part], wanted))
    return found


def _settling(
    side: Literal["a", "b"], time: Floats, temperature: Floats, setpoint: float
) -> Settling:
    error = temperature - setpoint
    outside = np.flatnonzero(np.abs(error) > STABLE_BAND)
    # Stretches inside the band lie between readings outside it.
    begins, ends = np.r_[0, outside + 1], np.r_[outside, time.size]
    held = time[np.maximum(ends - 1, 0)] - time[np.minimum(begins, time.size - 1)]
    # The log's rows see a stretch a little shorter than the controller did.
    lasting = np.flatnonzero((ends > begins) & (held > 0.95 * STABLE_TIME))
    settled = lasting.size > 0
    first = int(begins[lasting[0]]) if settled else 0
    step = setpoint - float(temperature[0])
    beyond = error if step >= 0 else -error
    return Settling(
        side=side,
        start=float(time[0]),
        setpoint=setpoint,
        step=step,
        settled=settled,
        settling_time=float(time[first] - time[0]) if settled else float("nan"),
        overshoot=max(float(beyond.max()), 0.0),
        error=float(error[time >= time[-1] - _END].mean()),
        longest_error=float(np.abs(error[first:]).max()) if settled else float("nan"),
    )
