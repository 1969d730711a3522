"""A log of any kind -> raw table of cells, each row knowing its line in the file."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from muscle_bayes.data.describing.columns import (
    COLUMN_KEYS,
    HEATER_COLUMNS,
    HEATER_HEADER,
    Columns,
    column_label,
)
from muscle_bayes.data.describing.log_format import LogFormat
from muscle_bayes.data.describing.metadata import Metadata
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.reading.frames import hdf5_rows, parquet_rows
from muscle_bayes.data.reading.header import (
    SaidUnit,
    place,
    take_header,
    unit_in_name,
    why_not_there,
)
from muscle_bayes.data.reading.lvm import is_lvm, lvm_body
from muscle_bayes.data.reading.preamble import cell_separator, join_broken_header, without_comments
from muscle_bayes.data.reading.rows import Row, parse_rows
from muscle_bayes.data.reading.text import decode, split_lines
from muscle_bayes.data.reading.widths import (
    fit_rows,
    pair_decimals,
    usual_width,
    without_blank_rows,
    without_cut_row,
    without_repeated_header,
)
from muscle_bayes.data.repairing.ledger import Repair

HEADER: Final[tuple[str, ...]] = (
    "Time (s)",
    "Temperature A (C)",
    "Setpoint A (C)",
    "Temperature Stable A",
    "Temperature B (C)",
    "Setpoint B (C)",
    "Temperature Stable B",
    "Temperature Update",
    "Potentiometer Reading",
)
"""The bench's own header, as the thesis' script writes it."""

_FIXTURE_COLUMNS: Final[dict[str, str | int]] = {
    "time": HEADER[0],
    "reading": HEADER[8],
    "temperature_a": HEADER[1],
    "temperature_b": HEADER[4],
    "setpoint_a": HEADER[2],
    "setpoint_b": HEADER[5],
}


@dataclass(frozen=True)
class RawLog:
    """Cells as text, before any number was read."""

    path: Path
    columns: dict[str, str]
    """canonical name -> the log's own column name"""
    cells: dict[str, tuple[str, ...]]
    """canonical name -> cells of that column"""
    lines: tuple[int, ...]
    """line of each row in the file, the header is 1"""
    unreadable: tuple[int, ...]
    """lines of the rows left out because their cells cannot be told apart"""
    repairs: tuple[Repair, ...]
    ordinals: tuple[int, ...] = ()
    """number of each row among all rows, those left out included, from 0"""
    said_units: dict[str, list[SaidUnit]] = field(default_factory=dict)
    """canonical name -> what the log says of that column's unit"""
    layout: LogFormat = field(default_factory=LogFormat)
    """how the cells are written: as the metadata say, or the file itself"""


def parse_log(
    content: bytes, path: Path, columns: Columns | None, layout: LogFormat | None = None
) -> RawLog:
    """Split a log into cells.

    Line ends may be LF, CR LF or CR in any mixture, blank lines count for nothing.

    Args:
        content: the file's bytes.
        path: serves the messages, and its suffix says whether tabs separate columns.
        columns: as in the metadata; None = the bench's own header.
        layout: as in the metadata; None = a plain CSV.

    Raises:
        RunError: the log cannot be split into cells; with file, row and column.
    """
    layout = layout or LogFormat()
    text, repairs = decode(content, path, layout.encoding)
    all_lines = split_lines(text)
    lines = [(n, line) for n, line in enumerate(all_lines, 1) if n > layout.skip_lines]
    ended = all_lines[-1] == ""
    lines = [(n, line) for n, line in lines if line.strip()]
    lines, separator = cell_separator(lines, layout, path)
    lines, comments, hidden = without_comments(lines, layout.comment, separator, columns)
    repairs += comments
    if comments and not lines:
        raise RunError.at(
            path, "the log holds comments only", "give its rows, or correct log.comment"
        )
    if layout.header and hidden is None:
        lines = join_broken_header(lines)
    rows, broken = parse_rows(lines, separator)
    return assemble(rows, broken, path, columns, layout, ended, repairs, hidden)


def assemble(
    rows: list[Row],
    broken: list[int],
    path: Path,
    columns: Columns | None,
    layout: LogFormat,
    ended: bool = True,
    repairs: Sequence[Repair] = (),
    hidden: Row | None = None,
) -> RawLog:
    """The wanted columns of rows, the first of which may be the header.

    Args:
        rows: all rows of cells.
        broken: lines that are no rows because a quote in them is not closed.
        path: serves the messages.
        columns: as in the metadata; None = the bench's own header.
        layout: as in the metadata.
        ended: whether the last line has its line end.
        repairs: what was repaired before.
        hidden: a header that stands in a comment, if one was found there.

    Raises:
        RunError: see `parse_log`.
    """
    repairs = list(repairs)
    paired = layout.decimal == "," and layout.cell_separator == ","
    header, said, rows, row = take_header(rows, hidden, columns, layout, path)
    names = _wanted(columns, layout, header)
    rows = pair_decimals(rows) if paired else rows
    width = len(header) if layout.header else usual_width(rows)
    hint = why_not_there(rows, names, layout, width) if layout.header else ""
    labels = header if layout.header else [f"column {i + 1}" for i in range(width)]
    own = HEADER if columns is None else ()
    places = {key: place(labels, name, path, row, own, hint) for key, name in names.items()}
    for name in own:
        place(header, name, path, row, own)
    rows, cut = without_cut_row(rows, width, ended)
    rows, blank = without_blank_rows(rows)
    repairs += blank
    if layout.header:
        rows, again = without_repeated_header(rows, header)
        repairs += again
    if broken:
        note = "a quote is opened and not closed: row dropped"
        repairs.append(Repair("broken quote", len(broken), broken[0], note))
    order = {line: at for at, line in enumerate(sorted([line for line, _ in rows] + broken))}
    named = "the header" if layout.header else "the log"
    rows, unreadable, uneven = fit_rows(rows, width, path, named)
    repairs += uneven
    if len(rows) < 2:
        raise RunError.at(
            path, f"{len(rows)} whole rows after the header", "give a log with two rows or more"
        )
    said_by_name = {at: unit_in_name(header[at]) for at in places.values() if layout.header}
    return RawLog(
        path=path,
        columns={
            key: labels[at] if isinstance(names[key], int) else column_label(names[key])
            for key, at in places.items()
        },
        cells={key: tuple(cells[at] for _, cells in rows) for key, at in places.items()},
        lines=tuple(line for line, _ in rows),
        unreadable=tuple(sorted([*unreadable, *broken])),
        repairs=(*repairs, *cut),
        ordinals=tuple(order[line] for line, _ in rows),
        said_units={
            key: [*said.get(at, []), *said_by_name.get(at, [])] for key, at in places.items()
        },
        layout=layout,
    )


def _wanted(columns: Columns | None, layout: LogFormat, header: list[str]) -> dict[str, str | int]:
    """Names of the columns; those of the heater where the bench's own header has them once."""
    if columns is None:
        heater = zip(HEATER_COLUMNS, HEATER_HEADER, strict=True)
        found = {key: name for key, name in heater if header.count(name) == 1}
        return {**_FIXTURE_COLUMNS, **found}
    named = {key: getattr(columns, key) for key in COLUMN_KEYS}
    if layout.sample_rate is not None:
        del named["time"]
    return {
        "reading" if key == "position" else key: name
        for key, name in named.items()
        if name is not None
    }


def parse_any(content: bytes, path: Path, metadata: Metadata) -> RawLog:
    """Cells of a log of any kind that is read; its suffix, and for LabVIEW its first line, say which.

    Args:
        content: the file's bytes.
        path: serves the messages and says the kind.
        metadata: of the run.

    Raises:
        RunError: the file is not of its kind, or cannot be split into cells.
    """
    suffix, layout = path.suffix.lower(), metadata.log
    if suffix == ".parquet":
        rows = parquet_rows(content, path)
        return assemble(rows, [], path, metadata.columns, layout)
    if suffix in (".h5", ".hdf5"):
        rows = hdf5_rows(content, path, layout.group)
        return assemble(rows, [], path, metadata.columns, layout)
    if is_lvm(content):
        skipped, stated = lvm_body(content, path, layout)
        layout = layout.model_copy(update={"skip_lines": skipped, **stated})
    return parse_log(content, path, metadata.columns, layout)
