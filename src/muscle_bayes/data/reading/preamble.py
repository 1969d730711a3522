"""What stands before a log's header: a `sep=` line, comments, and the separator that they say."""

import re
from pathlib import Path

from muscle_bayes.data.describing.columns import Columns
from muscle_bayes.data.describing.log_format import LogFormat
from muscle_bayes.data.reading.cells import is_number
from muscle_bayes.data.reading.rows import Row, parse_rows
from muscle_bayes.data.repairing.ledger import Repair

Lines = list[tuple[int, str]]
"""Numbers of lines in the file, from 1, and their text."""

_MOST_HEADER_LINES = 8
SEPARATOR_LINE = re.compile(r'"?sep=(.)"?,*\s*', re.IGNORECASE)
"""Excel's own line, which says what separates cells."""


def cell_separator(lines: Lines, layout: LogFormat, path: Path) -> tuple[Lines, str]:
    """The lines without Excel's `sep=` line, and what separates their cells."""
    said = SEPARATOR_LINE.fullmatch(lines[0][1]) if lines else None
    if said:
        lines = lines[1:]
    if layout.cell_separator is not None:
        return lines, layout.cell_separator
    if said:
        return lines, said[1]
    return lines, "\t" if path.suffix.lower() in (".tsv", ".lvm") else ","


def without_comments(
    lines: Lines, comment: str, separator: str, columns: Columns | None
) -> tuple[Lines, list[Repair], Row | None]:
    """The lines that are no comments; and the header where it stands in the last comment."""
    chosen = [(n, line) for n, line in lines if line.lstrip().startswith(comment)]
    if columns is not None and isinstance(columns.time, str) and columns.time.startswith(comment):
        chosen = []
    if not chosen:
        return lines, [], None
    numbers_of = {n for n, _ in chosen}
    kept = [(n, line) for n, line in lines if n not in numbers_of]
    repair = Repair("comment", len(chosen), chosen[0][0], f"begins with {comment!r}: no row")
    if not kept:
        return kept, [repair], None
    above = [(n, line) for n, line in chosen if n < kept[0][0]]
    hidden = None
    if above:
        first, _ = parse_rows(kept[:1], separator)
        row, _ = parse_rows([(above[-1][0], above[-1][1].lstrip()[len(comment) :])], separator)
        values = [cell for _, cells in first for cell in cells if cell.strip()]
        if row and first and len(row[0][1]) == len(first[0][1]) and all(map(is_number, values)):
            hidden = row[0]
    return kept, [repair], hidden


def join_broken_header(lines: Lines) -> Lines:
    """The lines with a header that is broken inside quotes made one, as spreadsheets break it."""
    if not lines or lines[0][1].count('"') % 2 == 0:
        return lines
    for end in range(2, min(len(lines), _MOST_HEADER_LINES) + 1):
        text = " ".join(line for _, line in lines[:end])
        if text.count('"') % 2 == 0:
            return [(lines[0][0], text), *lines[end:]]
    return lines
