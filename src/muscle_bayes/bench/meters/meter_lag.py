"""By how much a log's temperatures lag behind its readings of the angle."""

from typing import Final

from muscle_bayes.bench.meters.meter import Reading

LEAST: Final = 20
"""Changes of the meter's digits from which on their mean lag is told."""
LONGEST: Final = 0.25
"""Spacing of rows or requests, s, that leaves open when the digits changed."""


class MeterLag:
    """Mean time from a change of the meter's digits to where the log seems to have it.

    The digits change somewhere between two requests, on average halfway (taken that the meter answers
    what it shows when it is asked); the answer takes its time, and the next row may be near or far. Who
    reads the log can but put the change halfway between two rows. The lag is the distance of both
    halves.
    """

    def __init__(self) -> None:
        self._row: float | None = None
        self._reading: Reading | None = None
        self._sum = 0.0
        self._count = 0

    @property
    def mean(self) -> float | None:
        """s, None as long as too few changes were seen."""
        return self._sum / self._count if self._count >= LEAST else None

    def row(self, time: float, reading: Reading | None) -> None:
        """Take a row's host time [s] and the meter's reading in it."""
        before, shown = self._row, self._reading
        self._row, self._reading = time, reading
        if before is None or shown is None or reading is None:
            return
        if shown.asked is None or reading.asked is None:
            return
        if shown.temperatures == reading.temperatures or None in reading.temperatures:
            return
        if max(time - before, reading.asked - shown.asked) < LONGEST:
            self._sum += 0.5 * (time + before - reading.asked - shown.asked)
            self._count += 1
