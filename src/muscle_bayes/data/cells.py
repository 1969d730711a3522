"""Text of cells -> numbers."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def numbers(cells: Sequence[str]) -> NDArray[np.float64]:
    """Numbers of cells, NaN where a cell is none; the loop runs only if numpy refuses a cell."""
    try:
        return np.array(cells, dtype=np.float64)
    except ValueError:
        return np.array([_number(cell) for cell in cells], dtype=np.float64)


def _number(cell: str) -> float:
    try:
        return float(cell.strip().strip('"'))
    except ValueError:
        return np.nan
