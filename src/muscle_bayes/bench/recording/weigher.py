"""What a load cell says of a load that was hung or poured."""

from collections.abc import Callable
from typing import Final

from muscle_bayes.bench.boards.samples import TimedSample
from muscle_bayes.bench.sequences.sequence import LoadCell

SETTLES: Final = 1.0
"""s that a load swings after it was hung."""
WEIGHED: Final = 2.0
"""s over which the cell's counts are averaged then."""
LEAST: Final = 5
"""Conversions below which nothing was weighed."""


class Weigher:
    """Averages a load cell's counts after a load has changed; tells the mass once."""

    def __init__(self, cell: LoadCell, tell: Callable[[float], None]) -> None:
        """`tell` is called with a mass, kg."""
        self._cell = cell
        self._tell = tell
        self._from: float | None = None
        self._counts: list[int] = []

    def begin(self, time: float, pour_time: float = 0.0) -> None:
        """A load was hung at a host time [s], or is poured from then on."""
        self._from, self._counts = time + pour_time + SETTLES, []

    def mass(self, sample: TimedSample) -> float | None:
        """What the cell shows now, kg; None where it is silent. Counts towards the weighing."""
        if sample.load is None:
            return None
        if self._from is not None and sample.time >= self._from:
            self._counts.append(sample.load)
            if sample.time >= self._from + WEIGHED and len(self._counts) >= LEAST:
                mean = sum(self._counts) / len(self._counts)
                self._from = None
                self._tell(self._cell.mass(mean))
        return self._cell.mass(sample.load)
