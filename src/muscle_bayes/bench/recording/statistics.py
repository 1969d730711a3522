"""Figures of a run that grow with its rows and need no row kept."""

from math import inf

import numpy as np

_BINS_PER_MS = 10
_MOST_MS = 1000


class Histogram:
    """Times [s] counted in steps of 0.1 ms up to 1 s; quantiles are exact to the step."""

    def __init__(self) -> None:
        self._smallest, self._largest = inf, -inf
        self._bins = np.zeros(_BINS_PER_MS * _MOST_MS + 1, dtype=int)

    def add(self, seconds: float) -> None:
        """Count one."""
        self._smallest, self._largest = min(self._smallest, seconds), max(self._largest, seconds)
        self._bins[min(max(round(seconds * 1e3 * _BINS_PER_MS), 0), self._bins.size - 1)] += 1

    def summary(self) -> dict[str, float]:
        """Smallest, median, 95 and 99.9 % quantiles and largest, ms; empty where none was counted."""
        below = np.cumsum(self._bins)
        if below[-1] == 0:
            return {}
        shares = np.array([0.5, 0.95, 0.999])
        quantiles = np.searchsorted(below, shares * below[-1]) / _BINS_PER_MS
        names = ("min", "median", "p95", "p999", "max")
        told = (1e3 * self._smallest, *quantiles.tolist(), 1e3 * self._largest)
        return dict(zip(names, told, strict=True))
