"""Lines of text -> rows of cells, by Python's CSV parser."""

import csv
import re
from collections.abc import Sequence

Row = tuple[int, list[str]]
"""Line in the file, from 1, and the cells."""


def parse_rows(lines: Sequence[tuple[int, str]], separator: str) -> tuple[list[Row], list[int]]:
    """Cells of lines, quotes taken away.

    A line is a row: a quote that is opened and not closed spoils its own line only.

    Args:
        lines: line numbers and their text.
        separator: what stands between cells; a blank stands for any run of blanks.

    Returns:
        The rows, and the numbers of lines that are none.
    """
    if separator == " ":
        return [(line, text.split()) for line, text in lines], []
    if not any('"' in text for _, text in lines):
        try:
            cells = list(csv.reader([text for _, text in lines], delimiter=separator))
            return [(line, row) for (line, _), row in zip(lines, cells, strict=True)], []
        except (csv.Error, ValueError):
            pass  # the one line that is meant is found below
    rows: list[Row] = []
    unreadable: list[int] = []
    for line, text in lines:
        try:
            # Blanks before a separator keep a quoted cell from ending where its quote does.
            tight = re.sub(rf'"[ \t]+(?={re.escape(separator)}|$)', '"', text)
            (cells_of_line,) = csv.reader(
                [tight], delimiter=separator, strict=True, skipinitialspace=True
            )
            rows.append((line, cells_of_line))
        except (csv.Error, ValueError):
            unreadable.append(line)
    return rows, unreadable


def is_blank(row: Sequence[str]) -> bool:
    """Whether no cell of a row holds anything."""
    return not any(cell.strip() for cell in row)
