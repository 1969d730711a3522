"""A log's file -> what NAME.toml should say of it, and what the file cannot tell."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from muscle_bayes.data.describing.log_format import LogFormat
from muscle_bayes.data.guessing.layout import Layout, decimal_of, guess_layout
from muscle_bayes.data.guessing.roles import Column, describe_columns
from muscle_bayes.data.reading.frames import hdf5_rows, parquet_rows
from muscle_bayes.data.reading.lvm import is_lvm, lvm_body
from muscle_bayes.data.reading.text import split_lines
from muscle_bayes.data.reading.widths import pair_decimals


@dataclass
class Guess:
    """What was found in a log."""

    path: Path
    layout: Layout
    columns: list[Column] = field(default_factory=list)

    def column(self, wanted: str | int) -> Column | None:
        """The column of this name or number."""
        for column in self.columns:
            if wanted in (column.name, column.number, str(column.number)):
                return column
        return None

    def likely(self, *roles: str) -> list[Column]:
        """Columns that seem to hold one of these, those that change first."""
        columns = [column for column in self.columns if column.likely in roles]
        return sorted(columns, key=lambda column: not column.changes)

    @property
    def time(self) -> Column | None:
        """The time column: by name, else the first that rises evenly; None where none rises."""
        named = [column for column in self.likely("time") if column.rises or _wraps(column)]
        if named:
            return named[0]
        rising = [column for column in self.columns if column.rises and not column.likely]
        even = [column for column in rising if _even(column.values)]
        return even[0] if even else None

    @property
    def measured(self) -> list[Column]:
        """Columns that may hold the measured position or velocity, the likeliest first."""
        time = self.time
        named = [c for c in self.likely("position") if c is not time]
        named += [c for c in self.likely("velocity") if c is not time]
        if named:
            return named
        # A voltage may be what drives, or what a sensor shows.
        shown = [
            c
            for c in self.columns
            if c.likely == "drive" and (not c.unit or c.unit.kind == "voltage")
        ]
        others = [c for c in self.columns if not c.likely or c in shown]
        return [column for column in others if column.changes and column is not time]

    def facts(self) -> dict[str, Any]:
        """What was found, for JSON."""
        return {
            "path": self.path,
            "log": dict(self.layout.keys),
            "sample_rate": self.layout.sample_rate,
            "columns": [
                {
                    "number": column.number,
                    "name": column.name,
                    "likely": column.likely,
                    "unit": None if column.unit is None else column.unit.text,
                    "first": _first(column.values),
                    "rises": column.rises,
                    "changes": column.changes,
                }
                for column in self.columns
            ],
        }


def guess_log(content: bytes, path: Path) -> Guess:
    """What a log's file tells of itself.

    Args:
        content: the file's bytes.
        path: serves the messages, and its suffix says the kind.

    Raises:
        RunError: it holds no rows of numbers.
    """
    suffix = path.suffix.lower()
    if suffix in (".parquet", ".h5", ".hdf5"):
        rows = (
            parquet_rows(content, path) if suffix == ".parquet" else hdf5_rows(content, path, None)
        )
        header = rows[0][1]
        layout = Layout(header=header, rows=rows[1:], width=len(header))
    elif is_lvm(content):
        skipped, _ = lvm_body(content, path, LogFormat())
        lines = split_lines(content.decode("utf-8-sig", "replace"))
        layout = guess_layout("\n".join(lines[skipped:]).encode(), path)
        layout.keys = {key: value for key, value in layout.keys.items() if key != "separator"}
    else:
        layout = guess_layout(content, path)
    decimal, thousands = decimal_of(layout)
    rows = layout.rows
    width = layout.width
    if decimal == "," and layout.header and width == 2 * len(layout.header):
        rows = pair_decimals(rows)
        width //= 2
    cells = [tuple(row[at] for _, row in rows) for at in range(width)]
    columns = describe_columns(layout.header, layout.units_row, cells, decimal, thousands)
    return Guess(path, layout, columns)


def _even(values: np.ndarray) -> bool:
    """Whether numbers rise in nearly equal steps, as times do."""
    steps = np.diff(values[np.isfinite(values)])
    if steps.size < 2 or np.median(steps) <= 0:
        return False
    usual = float(np.median(steps))
    return bool(np.mean(np.abs(steps - usual) < 0.5 * usual) > 0.9)


def _wraps(column: Column) -> bool:
    """Whether a column called time rises but for a few places, where a counter may wrap."""
    steps = np.diff(column.values[np.isfinite(column.values)])
    return bool(steps.size > 1 and np.mean(steps >= 0) > 0.9)


def _first(values: np.ndarray) -> float | None:
    good = values[np.isfinite(values)]
    return float(good[0]) if good.size else None
