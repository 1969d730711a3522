"""A row of the log as it is written while a run is recorded."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from muscle_bayes.data import HEADER, HEATER_HEADER

LOG_HEADER: Final = (*HEADER, *HEATER_HEADER)
SECOND, LOAD, AIM = "Reading 2", "Load", "Wanted reading"
"""Columns of a second potentiometer [counts] and of a load cell [kg], where there is one, and of the
reading that the board is told to hold [counts]."""
TIME_DECIMALS: Final = 3


@dataclass(frozen=True)
class Row:
    """One row of the log; temperatures [C] are None where a channel has no thermocouple."""

    time: float
    """s after the first row"""
    temperature_a: float | None
    setpoint_a: float | None
    stable_a: bool
    temperature_b: float | None
    setpoint_b: float | None
    stable_b: bool
    update: bool
    """whether the temperatures are new"""
    reading: float
    """counts, in steps of RESOLUTION"""
    duties: tuple[int, int] | None = None
    """of both heaters, of 255; None while the heater board does not answer"""
    faults: int | None = None
    """latched on the heater board"""
    fan: bool | None = None
    """whether it is on"""
    second: float | None = None
    """reading of a second potentiometer, counts"""
    load: float | None = None
    """what the load cell shows, kg"""
    aim: float | None = None
    """reading that the board holds, counts"""


def format_row(row: Row, more: Sequence[str] = ()) -> bytes:
    """The row in the order of LOG_HEADER and of `more` columns (SECOND, LOAD, AIM), with its line end.

    A heater that is off has setpoint 0.0.
    """
    extra = {
        SECOND: "" if row.second is None else f"{row.second:g}",
        LOAD: "" if row.load is None else f"{row.load:.5f}",
        AIM: "" if row.aim is None else f"{row.aim:g}",
    }
    cells = (
        f"{row.time:.{TIME_DECIMALS}f}",
        _celsius(row.temperature_a),
        _celsius(row.setpoint_a or 0.0),
        str(int(row.stable_a)),
        _celsius(row.temperature_b),
        _celsius(row.setpoint_b or 0.0),
        str(int(row.stable_b)),
        str(int(row.update)),
        f"{row.reading:g}",
        *(("", "") if row.duties is None else map(str, row.duties)),
        "" if row.faults is None else str(row.faults),
        "" if row.fan is None else str(int(row.fan)),
        *(extra[name] for name in more),
    )
    return (",".join(cells) + "\n").encode()


def _celsius(value: float | None) -> str:
    """Tenths, or hundredths where a value has them."""
    text = "" if value is None else f"{value + 0.0:.2f}"
    return text.removesuffix("0")
