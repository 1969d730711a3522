"""The header of a log: where it is, names of columns, and the units that it and the row below say."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Final

from muscle_bayes.data.describing.columns import Columns, column_label
from muscle_bayes.data.describing.log_format import LogFormat
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.reading.cells import is_number
from muscle_bayes.data.reading.rows import Row
from muscle_bayes.data.units import is_unit

_SHOWN = 20
_BRACKETS = re.compile(r"^(.*?)[\s_]*[(\[{<]\s*([^()\[\]{}<>]*)\s*[)\]}>]\s*$")
_AFTER_SIGN = re.compile(r"^(.*\S)\s*[,;:/]\s*([^\s,;:/].*)$")
_RATE_SUFFIX = re.compile(r"^(.*[^_\s])[_\s]+([A-Za-z°µμ]+[_/](?:s|min))$")
_SUFFIX = re.compile(r"^(.*[^_\s])[_\s]+([A-Za-z°µμ%]+)$")


@dataclass(frozen=True)
class SaidUnit:
    """A unit that the log itself says of a column."""

    text: str
    where: str
    """what says it, for messages"""
    sure: bool
    """whether it stands as a unit (brackets, a units row) and not as the tail of a name"""
    in_row: bool = False
    """whether a units row says it"""


def bare(name: str) -> str:
    """A header's cell without blanks and quotes around it."""
    return name.strip().strip('"').strip()


def without_unit(name: str) -> str:
    """A column's name without the unit in brackets or after a sign at its end."""
    for pattern in (_BRACKETS, _AFTER_SIGN):
        if found := pattern.match(name):
            return found[1].strip()
    return name


def unit_in_name(name: str) -> list[SaidUnit]:
    """What the end of a column's name may say of its unit, the surest first."""
    said = []
    patterns = (
        (_BRACKETS, True),
        (_AFTER_SIGN, True),
        (_RATE_SUFFIX, False),
        (_SUFFIX, False),
    )
    for pattern, sure in patterns:
        if (found := pattern.match(name)) and found[2].strip():
            text = re.sub(r"_(s|min)$", r"/\1", found[2].strip())
            said.append(SaidUnit(text, f"the column's name {name!r}", sure))
    said.append(SaidUnit(name, f"the column's name {name!r}", False))
    return said


def is_units_row(row: Sequence[str]) -> bool:
    """Whether a row below the header holds units: (ms),(V) or s;deg."""
    cells = [re.sub(r"^[(\[{<]\s*|\s*[)\]}>]$", "", bare(cell)) for cell in row]
    words = [cell for cell in cells if cell and cell not in ("-", "1")]
    return (
        bool(words)
        and not any(is_number(cell) or is_number(cell, ",") for cell in words)
        and all(len(word) <= 20 for word in words)
        and sum(map(is_unit, words)) > len(words) / 2
    )


def unit_in_row(cell: str) -> list[SaidUnit]:
    """What a units row says of a column."""
    text = re.sub(r"^[(\[{<]\s*|\s*[)\]}>]$", "", bare(cell))
    return [SaidUnit(text, f"the units row ({text})", True, True)] if text else []


def place(
    header: Sequence[str], name: str | int, path: Path, row: int, own: Sequence[str], hint: str = ""
) -> int:
    """Where a column stands.

    Args:
        header: names of the columns, as `bare` gives them.
        name: the name wanted, or the column's number from 1.
        path: serves the messages.
        row: line of the header.
        own: the bench's own header, where it was expected, no [columns] being given; else empty.
        hint: what to do where the name is not there, if that is known.

    Raises:
        RunError: the name is not there, or there more than once.
    """
    if isinstance(name, int):
        if name > len(header):
            raise RunError.at(
                path,
                f"there is no such column, the log has {len(header)}",
                "correct the number in [columns], the first column is 1",
                row=row,
                column=column_label(name),
            )
        return name - 1
    wanted = column_label(name)
    short = [without_unit(found) for found in header]
    for names in (header, short):
        if names.count(wanted) == 1:
            return names.index(wanted)
        if names.count(wanted) > 1:
            problem = f"expected once, found {names.count(wanted)} times in the header"
            fix = "rename or remove the others, or give the column's number in [columns]"
            raise RunError.at(path, f"{problem} {_listed(header)}", fix, row=row, column=wanted)
    others = [one for one in header if one and one not in own]
    begins = [one for one in others if wanted.lower().startswith(one.lower())]
    close = get_close_matches(wanted, others, n=1) or begins
    near = f"; did you mean {close[0]!r}?" if close else ""
    if hint:
        fix = hint
    elif own:
        fix = (
            f"{f'rename {close[0]!r}' if close else 'name that column so'}, or write [columns] with "
            f"`muscle-bayes init {path.name} --overwrite`. Without [columns] the bench's header is "
            "expected"
        )
    else:
        fix = f"correct the name in [columns]{near}"
    raise RunError.at(
        path, f"expected, not found; found {_listed(header)}", fix, row=row, column=wanted
    )


def _listed(header: Sequence[str]) -> str:
    return ", ".join(repr(name[:60]) for name in header[:_SHOWN])


_HEADER_SOUGHT: Final = 60
"""Lines within which a header that stands lower than it should is looked for."""


def take_header(
    rows: list[Row], hidden: Row | None, columns: Columns | None, layout: LogFormat, path: Path
) -> tuple[list[str], dict[int, list[SaidUnit]], list[Row], int]:
    """Names of the columns, what a units row says, the rows below, and the header's line."""
    if not rows:
        raise RunError.at(path, "the log is empty", "give the log with its header and its rows")
    if not layout.header:
        return [], {}, rows, rows[0][0]
    if hidden is not None:
        line, cells = hidden
    else:
        (line, cells), rows = rows[0], rows[1:]
        _refuse_missing_header(cells, line, columns, path)
    header = [bare(name) for name in cells]
    while len(header) > 1 and not header[-1]:
        header.pop()
    if path.suffix.lower() == ".lvm" and len(header) > 1 and header[-1] == "Comment":
        header.pop()
    said: dict[int, list[SaidUnit]] = {}
    if rows and is_units_row(rows[0][1]):
        said = {at: unit_in_row(cell) for at, cell in enumerate(rows[0][1])}
        rows = rows[1:]
    return header, said, rows, line


def why_not_there(
    rows: list[Row], names: dict[str, str | int], layout: LogFormat, width: int
) -> str:
    """What to do where the header's line does not hold the names, as far as the file tells."""
    wanted = {column_label(name) for name in names.values() if isinstance(name, str)}
    for line, cells in rows[:_HEADER_SOUGHT]:
        if wanted and wanted <= {bare(cell) for cell in cells}:
            return f"the header stands in row {line}: add skip_lines = {line - 1} to [log]"
    if layout.cell_separator is None:
        for sign, word in ((";", ";"), ("\t", "tab"), ("|", "|")):
            if rows and all(sign in ",".join(cells) for _, cells in rows[:20]):
                return (
                    f'the columns are separated by {word!r}: add separator = "{word}" to [log], '
                    'or separate the columns by commas (decimal = "," where numbers have one)'
                )
        if width == 1 and rows and all("," in cells[0] for _, cells in rows[:20]):
            return "each row stands in quotes as one cell: export it without them"
        if width == 1 and rows and all(len(cells[0].split()) > 1 for _, cells in rows[:20]):
            return 'the columns are separated by blanks: add separator = "space" to [log]'
    return ""


def _refuse_missing_header(
    cells: list[str], line: int, columns: Columns | None, path: Path
) -> None:
    """A first row of numbers is no header, if the metadata name columns by text."""
    if columns is None or not all(is_number(cell) or not cell.strip() for cell in cells):
        return
    if columns.time is not None and {bare(cell) for cell in cells} & {str(columns.time)}:
        return
    shown = ", ".join(repr(cell.strip()[:20]) for cell in cells[:6])
    raise RunError.at(
        path,
        f"the log has no header, its first row holds numbers: {shown}",
        "add header = false to [log] and name the columns by number in [columns], "
        "the first being 1",
        row=line,
        key="log.header",
    )
