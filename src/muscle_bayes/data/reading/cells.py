"""Text of cells -> numbers."""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?|[+-]?inf(inity)?|nan", re.IGNORECASE)


LARGEST = 1e30
"""Numbers beyond this are no measurement in any unit."""


def numbers(
    cells: Sequence[str], decimal: str = ".", thousands: str | None = None
) -> NDArray[np.float64]:
    """Numbers of cells, NaN where a cell is none; what is beyond LARGEST is none.

    Args:
        cells: text of one column.
        decimal: decimal sign.
        thousands: sign between thousands, None = none; where it stands wrongly a cell is no number.

    Returns:
        Numbers, shape (cells,).
    """
    if decimal == "." and thousands is None:
        try:
            values = np.array(cells, dtype=np.float64)
        except ValueError:
            pass
        else:
            if not any("_" in cell for cell in cells):  # Python's own digits may be grouped by it
                return _sane(values)
    return _sane(np.array([_number(cell, decimal, thousands) for cell in cells], dtype=np.float64))


def blank_cells(cells: Sequence[str]) -> NDArray[np.bool_]:
    """Which cells are empty, or say nan as pandas writes an empty one, shape (cells,)."""
    return np.array([cell.strip().lower() in ("", "nan") for cell in cells], dtype=bool)


def is_number(cell: str, decimal: str = ".") -> bool:
    """Whether a cell holds a number and nothing else."""
    return bool(_NUMBER.fullmatch(_bare(cell).replace(decimal, ".")))


def _sane(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(np.abs(values) <= LARGEST, values, np.nan)


def _bare(cell: str) -> str:
    return cell.strip().strip('"').strip().replace("\u2212", "-")  # the typographic minus sign


def _number(cell: str, decimal: str, thousands: str | None) -> float:
    text = _bare(cell)
    if thousands is not None and thousands in text:
        sign = re.escape(thousands)
        if not re.fullmatch(rf"[+-]?\d{{1,3}}({sign}\d{{3}})+({re.escape(decimal)}\d*)?", text):
            return np.nan
        text = text.replace(thousands, "")
    if decimal != ".":
        if "." in text:
            return np.nan
        text = text.replace(decimal, ".")
    if not _NUMBER.fullmatch(text):
        return np.nan
    return float(text.replace("d", "e").replace("D", "e") if "n" not in text.lower() else text)
