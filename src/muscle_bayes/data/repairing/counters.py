"""Time counters that wrap: 16 or 32 bits of milliseconds or microseconds, and midnight."""

from typing import Final

import numpy as np

from muscle_bayes.data.reading.clock_formats import DAY
from muscle_bayes.data.repairing.clock import median_spacing
from muscle_bayes.data.repairing.ledger import Ledger, Repair

_BITS: Final = (16, 32)
_TICKS: Final = (1.0, 1e-3, 1e-6)
"""Logged numbers a tick of the counter: as counted, in thousands, in millions."""
_MOST_SPACINGS: Final = 20.0
"""A counter that wraps goes on within this many usual spacings."""


def unwrap_counter(ledger: Ledger, clock: str) -> None:
    """Add the counter's period to all rows after each wrap, and report it.

    A backward jump is a wrap where the period of a 16- or 32-bit counter, added to it, makes an
    ordinary spacing. Times must be finite and still in the log's own unit.

    Args:
        ledger: columns under repair.
        clock: format of the time column, see `read_times`.
    """
    time = ledger.columns["time"].copy()
    spacing = np.diff(time)
    back = np.flatnonzero(spacing < 0) + 1
    usual = median_spacing(time)
    if not back.size or usual == 0.0:
        return
    for name, period in _periods(clock):
        step = spacing[back - 1] + period
        wraps = back[(step > 0) & (step <= _MOST_SPACINGS * usual) & (time[back] >= 0)]
        if not wraps.size or time.max() >= period * (1 + 1e-9) or period < _MOST_SPACINGS * usual:
            continue
        turns = np.zeros(time.size)
        turns[wraps] = period
        ledger.columns["time"] = time + np.cumsum(turns)
        said = "passes midnight" if name == "midnight" else f"counter of {name} wraps"
        note = f"the time {said}: {period:.10g} added to later rows, each time"
        ledger.repairs.append(
            Repair("wrapped counter", int(wraps.size), int(ledger.lines[wraps[0]]), note)
        )
        return


def _periods(clock: str) -> list[tuple[str, float]]:
    """What may wrap in a time column of this format: name and period."""
    if clock == "hms":
        return [("midnight", DAY)]
    if clock != "number":
        return []
    return [(f"{bits} bits", 2.0**bits * tick) for bits in _BITS for tick in _TICKS]
