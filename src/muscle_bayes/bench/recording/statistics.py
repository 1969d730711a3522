"""Figures of a run that grow with its rows and need no row kept."""

from dataclasses import dataclass, field
from math import inf, nan

_BINS_PER_MS = 10
_MOST_MS = 1000


@dataclass
class Histogram:
    """Times [s] counted in steps of 0.1 ms up to 1 s; quantiles are exact to the step."""

    count: int = 0
    largest: float = -inf
    smallest: float = inf
    _bins: list[int] = field(default_factory=lambda: [0] * (_BINS_PER_MS * _MOST_MS + 1))

    def add(self, seconds: float) -> None:
        """Count one."""
        self.count += 1
        self.largest = max(self.largest, seconds)
        self.smallest = min(self.smallest, seconds)
        place = round(seconds * 1e3 * _BINS_PER_MS)
        self._bins[min(max(place, 0), len(self._bins) - 1)] += 1

    def quantile(self, share: float) -> float:
        """s below which that share lies; NaN where nothing was counted."""
        if self.count == 0:
            return nan
        wanted, found = share * self.count, 0
        for place, number in enumerate(self._bins):
            found += number
            if found >= wanted and number:
                return place / (1e3 * _BINS_PER_MS)
        return self.largest

    def summary(self) -> dict[str, float | None]:
        """Smallest, median, 95 and 99.9 % quantiles and largest, ms."""
        if self.count == 0:
            return {}
        quantiles = {"median": 0.5, "p95": 0.95, "p999": 0.999}
        return {
            "min": 1e3 * self.smallest,
            **{name: 1e3 * self.quantile(share) for name, share in quantiles.items()},
            "max": 1e3 * self.largest,
        }
