"""Angles that are logged within one turn, and jump where the turn is full."""

from math import pi
from typing import Final

import numpy as np

from muscle_bayes.data.repairing.ledger import Ledger

_FULL: Final = 0.1
"""A jump of one turn within this share of it is a wrap."""
_STEP: Final = pi / 2
"""Between wraps the angle moves by less than this from row to row, rad."""


def unwrap_turns(ledger: Ledger, scale: float) -> None:
    """Add or take a turn where an angle jumps by one (359 -> 0 deg, pi -> -pi), and report it.

    Where the angle also moves fast, turns cannot be told from motion: nothing is changed.

    Args:
        ledger: columns under repair, readings finite.
        scale: rad in one unit of the readings.
    """
    turn = 2 * pi / scale
    reading = ledger.columns["reading"]
    step = np.diff(reading, prepend=reading[:1])
    wraps = np.abs(np.abs(step) - turn) < _FULL * turn
    if not wraps.any() or np.any(np.abs(step[~wraps]) * scale > _STEP):
        return
    ledger.columns["reading"] = reading - np.cumsum(np.where(wraps, np.sign(step), 0.0)) * turn
    name = ledger.names["reading"]
    ledger.note("wrapped angle", wraps, f"column {name!r} jumps by one turn: turn added or taken")
