"""Cells of a time column -> seconds: plain numbers, HH:MM:SS, ISO dates, or a stated pattern."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import partial
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from muscle_bayes.data.reading.cells import numbers

DAY: Final = 86_400.0
"""s"""
_CLOCK = re.compile(r"(?:(\d{1,4}):)?(\d{1,2}):(\d{1,2}(?:[.,]\d*)?)")
_DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d")


class Times(NamedTuple):
    """A time column read."""

    values: NDArray[np.float64]
    """in s, but numbers in the log's own unit; NaN where a cell is no time; shape (cells,)"""
    kind: str
    """number, hms, iso or pattern"""


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
    kind = time_format or _recognise(cells)
    if kind == "number":
        return Times(numbers(cells, decimal, thousands), kind)
    read = _clock if kind == "hms" else partial(_moment, None if kind == "iso" else kind)
    values = np.array([read(cell.strip().strip('"')) for cell in cells])
    return Times(values, kind if kind in ("hms", "iso") else "pattern")


def _recognise(cells: Sequence[str]) -> str:
    some = [cell.strip().strip('"') for cell in cells[:200] if cell.strip()]
    for pattern, kind in ((_CLOCK, "hms"), (_DATE, "iso")):
        matched = sum(bool(pattern.match(cell)) for cell in some)
        if some and matched > len(some) / 2:
            return kind
    return "number"


def _clock(cell: str) -> float:
    match = _CLOCK.fullmatch(cell)
    if match is None:
        return np.nan
    hours, minutes, seconds = match[1] or "0", match[2], match[3].replace(",", ".")
    if int(minutes) >= 60 or float(seconds) >= 61:
        return np.nan
    return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds)


def _moment(pattern: str | None, cell: str) -> float:
    """Unix time, by a pattern or as ISO; without a zone taken for UTC, which shifts the origin only."""
    try:
        if pattern is None:
            moment = datetime.fromisoformat(cell.replace(",", "."))
        else:
            moment = datetime.strptime(cell, pattern)
        if moment.tzinfo is None:
            moment = moment.replace(tzinfo=UTC)
        return moment.timestamp()
    except (ValueError, OverflowError, re.error):
        return np.nan
