"""Log text -> raw table of cells, each row knowing its line in the file."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Final

from muscle_bayes.data.errors import RunError
from muscle_bayes.data.heater_columns import with_heater_columns
from muscle_bayes.data.repair import Repair
from muscle_bayes.data.tables import Columns

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
"""The fixture's own header, as the thesis' script writes it."""

_FIXTURE_COLUMNS: Final = {
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


def parse_log(content: bytes, path: Path, columns: Columns | None) -> RawLog:
    """Split a log into cells; `columns` as in the metadata, None = the fixture's own header.

    Line ends may be LF, CR LF or CR in any mixture, blank lines count for nothing. Raises RunError.
    """
    text, repairs = _decode(content, path)
    lines = re.sub("\r\n?", "\n", text).split("\n")
    rows = [(n, line.split(",")) for n, line in enumerate(lines, 1) if line and not line.isspace()]
    if not rows:
        raise RunError.at(path, "the log is empty", "give the log with its header and its rows")
    header = [_bare(name) for name in rows.pop(0)[1]]
    names = with_heater_columns(_wanted(columns), header, own=columns is None)
    places = {key: _place(header, name, path, columns) for key, name in names.items()}
    if columns is None:
        for name in HEADER:
            _place(header, name, path, columns)
    rows, short = _without_cut_row(rows, len(header), ended=lines[-1] == "")
    long = [line for line, row in rows if _too_long(row, len(header))]
    if long:
        rows = [(line, row) for line, row in rows if not _too_long(row, len(header))]
        note = f"more than the header's {len(header)} cells: row dropped"
        repairs.append(Repair("long row", len(long), long[0], note))
    if len(rows) < 2:
        raise RunError.at(
            path, f"{len(rows)} whole rows after the header", "give a log with two rows or more"
        )
    cells = {
        key: tuple(row[place] if place < len(row) else "" for _, row in rows)
        for key, place in places.items()
    }
    lines_kept = tuple(line for line, _ in rows)
    return RawLog(path, names, cells, lines_kept, tuple(long), (*repairs, *short))


def _bare(name: str) -> str:
    return name.strip().strip('"').strip()


def _decode(content: bytes, path: Path) -> tuple[str, list[Repair]]:
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise RunError.at(path, "the log is UTF-16 text", "save it as UTF-8")
    try:
        return content.decode("utf-8-sig"), []
    except UnicodeDecodeError as error:
        before = content[: error.start].replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        line = before.count(b"\n") + 1
        repair = Repair("encoding", 1, line, "not UTF-8: the whole file was read as Latin-1")
        return content.decode("latin-1"), [repair]


def _wanted(columns: Columns | None) -> dict[str, str]:
    if columns is None:
        return dict(_FIXTURE_COLUMNS)
    named = {"time": columns.time, "reading": columns.position}
    for key in ("temperature_a", "temperature_b", "load", "applied"):
        if (name := getattr(columns, key)) is not None:
            named[key] = name
    return {key: _bare(name) for key, name in named.items()}


def _place(header: Sequence[str], name: str, path: Path, columns: Columns | None) -> int:
    """Where a column stands in the header."""
    found = header.count(name)
    if found == 1:
        return header.index(name)
    listed = ", ".join(repr(name[:60]) for name in header[:20])
    if found > 1:
        problem = f"expected once, found {found} times in the header {listed}"
        raise RunError.at(path, problem, "rename or remove the others", row=1, column=name)
    close = get_close_matches(name, header, n=1)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    if ";" in listed or "\\t" in listed:
        mend = "separate the columns by commas, with a point in decimal numbers"
    elif columns is None:
        mend = f"give the fixture's header, or name the log's own columns in [columns]{hint}"
    else:
        mend = f"correct the name in [columns]{hint}"
    raise RunError.at(path, f"expected, not found; found {listed}", mend, row=1, column=name)


_Rows = list[tuple[int, list[str]]]


def _without_cut_row(rows: _Rows, width: int, ended: bool) -> tuple[_Rows, list[Repair]]:
    """Drop a last row that lacks cells, or whose last cell lacks its end.

    A number cut short is still a number: without a line end, a last cell that is the beginning of
    the cell above it (51 below 512) is taken for cut.
    """
    if not rows:
        return rows, []
    line, last = rows[-1]
    cut = len(last) < width
    if not ended and not cut and len(rows) > 1:
        above, cell = rows[-2][1][-1].strip(), last[-1].strip()
        cut = cell == "" or (cell != above and above.startswith(cell))
    if not cut:
        return rows, []
    return rows[:-1], [Repair("cut row", 1, line, "the last row is cut short: dropped")]


def _too_long(row: list[str], width: int) -> bool:
    """More cells than the header: which is whose cannot be told. Blank ones at the end are none."""
    return len(row) > width and any(cell.strip() for cell in row[width:])
