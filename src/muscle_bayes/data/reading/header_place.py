"""Where a log's header is, what is wrong where it is not there, and the units row below it."""

from pathlib import Path
from typing import Final

from muscle_bayes.data.describing.columns import Columns
from muscle_bayes.data.describing.log_format import LogFormat
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.names import column_label
from muscle_bayes.data.reading.cells import is_number
from muscle_bayes.data.reading.header import SaidUnit, bare, is_units_row, unit_in_row
from muscle_bayes.data.reading.rows import Row

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
