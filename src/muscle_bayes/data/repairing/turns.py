"""Positions that are logged within a period, a turn or a counter's, and jump where it is full."""

from typing import Final

import numpy as np

from muscle_bayes.data.repairing.ledger import Ledger

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
