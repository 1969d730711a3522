"""Counters and positions that wrap: time of 16 or 32 bits, midnight, a turn."""

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


_FULL: Final = 0.1
"""A jump of one period within this share of it is a wrap."""
_STEP: Final = 0.25
"""Between wraps the position moves by less than this from row to row, in periods."""


def unwrap_position(ledger: Ledger, period: float, rule: str, what: str) -> None:
    """Add or take a period where a position jumps by one (359 -> 0 deg, 65535 -> 0), and report it.

    Where the position also moves fast, periods cannot be told from motion: nothing is changed.

    Args:
        ledger: columns under repair, readings finite.
        period: in the unit of the readings.
        rule: name of the repair.
        what: the period, in words.
    """
    reading = ledger.columns["reading"]
    step = np.diff(reading, prepend=reading[:1])
    wraps = np.abs(np.abs(step) - period) < _FULL * period
    if not wraps.any() or np.any(np.abs(step[~wraps]) > _STEP * period):
        return
    ledger.columns["reading"] = reading - np.cumsum(np.where(wraps, np.sign(step), 0.0)) * period
    name = ledger.names["reading"]
    ledger.note(rule, wraps, f"column {name!r} jumps by one {what}: {what} added or taken")
