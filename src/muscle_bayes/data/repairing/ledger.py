"""Columns under repair, and the report of what was repaired."""

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

    def refusal(
        self,
        problem: str,
        fix: str,
        at: "int | np.integer | Mask | None" = None,
        column: str | None = None,
        key: str | None = None,
    ) -> RunError:
        """What is wrong with a column, at a row of the table or the first row of a mask."""
        if isinstance(at, np.ndarray):
            at = np.flatnonzero(at)[0]
        row = None if at is None else int(self.lines[at])
        name = None if column is None else self.names[column]
        return RunError.at(self.path, problem, fix, row=row, column=name, key=key)

    def _refuse_many(self) -> None:
        if len(self.faulty) > max(1.0, MOST_FAULTY * self.total):
            told = "; ".join(map(str, self.repairs))
            problem = f"{len(self.faulty)} of {self.total} rows are faulty, more than "
            raise RunError.at(
                self.path,
                f"{problem}{MOST_FAULTY:.0%} ({told})",
                "correct or cut the log",
                row=min(self.faulty),
            )

    def note(self, rule: str, mask: Mask, note: str) -> None:
        """Report the rows in `mask`, if any, as something that is no fault."""
        if mask.any():
            self.repairs.append(Repair(rule, int(mask.sum()), int(self.lines[mask][0]), note))

    def drop(self, mask: Mask) -> None:
        """Remove rows from every column."""
        self.columns = {key: values[~mask] for key, values in self.columns.items()}
        self.lines = self.lines[~mask]
