"""The rules by which faulty cells of a log are repaired, and the report of what was done."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from muscle_bayes.data.errors import RunError

MOST_FAULTY: Final = 0.05
"""Share of rows with a fault above which a log is refused."""

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Repair:
    """One rule applied to one log."""

    rule: str
    count: int
    """rows, or places, that the rule met"""
    first_row: int
    """line in the file of the first of them, the header is 1"""
    note: str
    """what was wrong and what was done"""

    def __str__(self) -> str:
        return f"{self.rule}: {self.count}, first in row {self.first_row}; {self.note}"


@dataclass
class Ledger:
    """Columns under repair: rows are dropped together, and every fault is counted once a row."""

    path: Path
    names: dict[str, str]
    """canonical name -> the log's own column name"""
    columns: dict[str, Floats]
    lines: NDArray[np.int64]
    repairs: list[Repair] = field(default_factory=list)
    faulty: set[int] = field(default_factory=set)
    """lines with a fault, those left out before included"""
    total: int = field(init=False)

    def __post_init__(self) -> None:
        self.total = self.lines.size + len(self.faulty)
        self._refuse_many()

    def record(self, rule: str, mask: Mask, note: str) -> None:
        """Report the rows in `mask`, if any. Raises RunError past MOST_FAULTY of all rows."""
        if not mask.any():
            return
        lines = self.lines[mask]
        self.repairs.append(Repair(rule, int(mask.sum()), int(lines[0]), note))
        self.faulty.update(lines.tolist())
        self._refuse_many()

    def _refuse_many(self) -> None:
        if len(self.faulty) > max(1.0, MOST_FAULTY * self.total):
            told = "; ".join(map(str, self.repairs))
            raise RunError.at(
                self.path,
                f"{len(self.faulty)} of {self.total} rows are faulty, more than "
                f"{MOST_FAULTY:.0%} ({told})",
                "correct or cut the log",
                row=min(self.faulty),
            )

    def drop(self, mask: Mask) -> None:
        """Remove rows from every column."""
        self.columns = {key: values[~mask] for key, values in self.columns.items()}
        self.lines = self.lines[~mask]


def drop_faulty(ledger: Ledger, key: str) -> None:
    """A time, position or applied force that is no finite number: the row is dropped."""
    mask = ~np.isfinite(ledger.columns[key])
    ledger.record(
        "bad cell", mask, f"column {ledger.names[key]!r} blank or no finite number: row dropped"
    )
    ledger.drop(mask)


def hold_last(ledger: Ledger, key: str, faulty: Mask, rule: str, what: str) -> None:
    """A slow quantity that is missing: hold the last good value (before the first, the first)."""
    ledger.record(rule, faulty, f"column {ledger.names[key]!r} {what}: last value held")
    if not faulty.any():
        return
    good = np.flatnonzero(~faulty)
    source = good[np.maximum(np.searchsorted(good, np.arange(faulty.size), side="right") - 1, 0)]
    ledger.columns[key] = ledger.columns[key][source]


def hold_temperature(ledger: Ledger, key: str) -> None:
    """Blank cells, and readings that only an open thermocouple gives, hold the last value."""
    values = ledger.columns[key]
    hold_last(ledger, key, ~np.isfinite(values), "bad cell", "blank or no finite number")
    values = ledger.columns[key]
    hold_last(ledger, key, (values < -60) | (values > 500), "wild temperature", "beyond -60..500 C")


def drop_glitches(ledger: Ledger, step: float = 1.0) -> None:
    """A reading that no mean of 10-bit counts in these steps has: a few are dropped, more refused.

    Few are one in a thousand rows.
    """
    reading = ledger.columns["reading"]
    whole = np.rint(reading / step) * step
    mask = (reading < 0) | (reading > 1023) | (np.abs(reading - whole) > 1e-6)
    if mask.sum() > max(1, ledger.total // 1000):
        first = int(np.flatnonzero(mask)[0])
        raise RunError.at(
            ledger.path,
            f"{reading[first]:g} is no 10-bit count, and {mask.sum()} rows have such readings",
            "log whole counts of 0..1023, or set columns.position_unit to the unit it is in",
            row=int(ledger.lines[first]),
            column=ledger.names["reading"],
        )
    name = ledger.names["reading"]
    ledger.record("glitch", mask, f"column {name!r} is no whole count of 0..1023: row dropped")
    ledger.drop(mask)
