"""Cells of a time column -> seconds: plain numbers, HH:MM:SS, ISO dates, or a stated pattern."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from muscle_bayes.data.reading.cells import numbers

DAY: Final = 86_400.0
"""s"""
_CLOCK = re.compile(r"(?:(\d{1,4}):)?(\d{1,2}):(\d{1,2}(?:[.,]\d*)?)")
_DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d")

Kind = Literal["number", "hms", "iso", "pattern"]
_NAMED: Final[dict[str, Kind]] = {"number": "number", "hms": "hms", "iso": "iso"}


class Times(NamedTuple):
    """A time column read."""

    values: NDArray[np.float64]
    """in s, but numbers in the log's own unit; NaN where a cell is no time; shape (cells,)"""
    kind: Kind


def read_times(
    cells: Sequence[str], time_format: str | None, decimal: str, thousands: str | None
) -> Times:
    """Times of cells.

    Args:
        cells: text of the time column.
        time_format: as [log] states it; None = recognised by the first cells that are not blank.
        decimal: decimal sign.
        thousands: sign between thousands.

    Returns:
        Times, and the format in which they stood.
    """
    kind = _recognise(cells) if time_format is None else _NAMED.get(time_format, "pattern")
    if kind == "number":
        return Times(numbers(cells, decimal, thousands), kind)
    if kind == "hms":
        return Times(np.array([_clock(cell) for cell in cells]), kind)
    if kind == "iso":
        return Times(np.array([_date(cell) for cell in cells]), kind)
    return Times(np.array([_stamp(cell, time_format or "") for cell in cells]), kind)


def _recognise(cells: Sequence[str]) -> Kind:
    some = [cell.strip().strip('"') for cell in cells[:200] if cell.strip()]
    for pattern, kind in ((_CLOCK, "hms"), (_DATE, "iso")):
        matched = sum(bool(pattern.match(cell)) for cell in some)
        if some and matched > len(some) / 2:
            return kind  # type: ignore[return-value]
    return "number"


def _clock(cell: str) -> float:
    match = _CLOCK.fullmatch(cell.strip().strip('"'))
    if match is None:
        return np.nan
    hours, minutes, seconds = match[1] or "0", match[2], match[3].replace(",", ".")
    if int(minutes) >= 60 or float(seconds) >= 61:
        return np.nan
    return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds)


def _date(cell: str) -> float:
    try:
        return _seconds(datetime.fromisoformat(cell.strip().strip('"').replace(",", ".")))
    except (ValueError, OverflowError):
        return np.nan


def _stamp(cell: str, pattern: str) -> float:
    try:
        return _seconds(datetime.strptime(cell.strip().strip('"'), pattern))
    except (ValueError, OverflowError, re.error):
        return np.nan


def _seconds(moment: datetime) -> float:
    """Unix time; a moment without a zone is taken for UTC, which shifts the origin only."""
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=UTC)
    return moment.timestamp()
