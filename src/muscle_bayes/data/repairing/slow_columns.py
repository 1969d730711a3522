"""Columns that are blank in most rows, because their sensor is slower than the log's rows."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from muscle_bayes.data.repairing.faults import FAILURES, TEMPERATURE_FLOOR
from muscle_bayes.data.repairing.jumps import find_jumps
from muscle_bayes.data.repairing.ledger import Floats, Ledger, Mask, Repair

_MOST_BLANK: Final = 0.4
"""Share of blank cells from which a column may be a slower sensor's."""
_EVEN: Final = 3.0
"""Rows between values are at most this many times the usual number."""
_FEWEST: Final = 3
"""Values of a slower sensor."""


def is_slower(blank: Mask) -> bool:
    """Whether blank cells follow a pattern: a value every so many rows.

    Args:
        blank: which cells are empty, shape (rows,).
    """
    at = np.flatnonzero(~blank)
    if at.size < _FEWEST or blank.mean() < _MOST_BLANK:
        return False
    between = np.diff(np.r_[at, max(blank.size, at[-1] + 1)])
    longest = _EVEN * float(np.median(between))
    return bool(between.max() <= longest and at[0] <= longest)


def fill_slow_columns(ledger: Ledger, blank: Mapping[str, Mask]) -> dict[str, Floats]:
    """Give every row a value of the slower sensors, and report it.

    Temperatures lie on straight lines between their own readings; loads, setpoints and applied
    forces keep their last value. Rows without a position, where that is the slower sensor, hold
    only other sensors' values and leave the table.

    Args:
        ledger: columns under repair; times finite.
        blank: column -> which of its cells are empty.

    Returns:
        Times of each slower sensor's own readings, in the unit of the time column.
    """
    slower = {key: mask for key, mask in blank.items() if key in ledger.columns and is_slower(mask)}
    times: dict[str, Floats] = {}
    time = ledger.columns["time"]
    for key, mask in slower.items():
        if key == "reading":
            continue
        name, values = ledger.names[key], ledger.columns[key].copy()
        own = np.isfinite(values)
        if own.sum() < _FEWEST:
            continue
        if key.startswith("temperature"):
            failed = np.zeros(own.size, dtype=bool)
            failed[own] = find_jumps(values[own], floor=TEMPERATURE_FLOOR, failures=FAILURES)
            ledger.record(
                "impossible jump", failed, f"column {name!r} jumps and comes back at once: left out"
            )
            own &= ~failed
            rising = time if np.all(np.diff(time[own]) > 0) else np.arange(time.size, dtype=float)
            filled = np.interp(rising, rising[own], values[own])
            how = "straight lines between its own readings"
        else:
            good = np.flatnonzero(own)
            last = np.searchsorted(good, np.arange(own.size), side="right") - 1
            filled = values[good[np.maximum(last, 0)]]
            how = "last value held between its own readings"
        _report(ledger, mask, f"column {name!r} is blank in {{rows}} rows: {how}")
        ledger.columns[key] = np.where(own, values, filled)
        times[key] = time[own]
    if "reading" in slower:
        mask = slower["reading"] & ~np.isfinite(ledger.columns["reading"])
        name = ledger.names["reading"]
        what = "is blank in {rows} rows, which hold other sensors' values: rows left out"
        _report(ledger, mask, f"column {name!r} {what}")
        ledger.drop(mask)
    return times


def _report(ledger: Ledger, blank: Mask, note: str) -> None:
    """One entry a column: blank cells of a slower sensor are no faults."""
    told = note.replace("{rows}", f"{int(blank.sum())} of {blank.size}")
    ledger.repairs.append(Repair("slower sensor", 1, int(ledger.lines[blank][0]), told))
