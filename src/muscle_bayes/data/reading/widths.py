"""Rows that do not have the header's number of cells."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from muscle_bayes.data.errors import RunError
from muscle_bayes.data.reading.cells import is_number
from muscle_bayes.data.reading.header import bare
from muscle_bayes.data.reading.rows import Row, is_blank
from muscle_bayes.data.repairing.ledger import MOST_FAULTY, Repair


def fit_rows(
    rows: list[Row], width: int, path: Path, named: str
) -> tuple[list[Row], list[int], list[Repair]]:
    """Leave out rows with fewer or more cells than the header has names.

    Blank cells at a row's end are none. A last row without its last cells is the reader's
    `without_cut_row`'s business and is not here any more.

    Args:
        rows: rows below the header.
        width: number of the header's names.
        path: serves the messages.
        named: what `width` is taken from, for messages.

    Returns:
        Rows of the header's width, lines of the others, and what was repaired.

    Raises:
        RunError: nearly all rows, or all from some row on, have another number of cells.
    """
    lengths = [_length(row, width) for _, row in rows]
    wrong = [at for at, length in enumerate(lengths) if length != width]
    if len(wrong) > max(1.0, MOST_FAULTY * len(rows)):
        _refuse(rows, lengths, wrong, width, path, named)
    repairs = []
    for rule, word, chosen in (
        ("short row", "fewer", [at for at in wrong if lengths[at] < width]),
        ("long row", "more", [at for at in wrong if lengths[at] > width]),
    ):
        if chosen:
            note = f"{word} than {named}'s {width} cells: row dropped"
            repairs.append(Repair(rule, len(chosen), rows[chosen[0]][0], note))
    kept = [row for row, length in zip(rows, lengths, strict=True) if length == width]
    return kept, [rows[at][0] for at in wrong], repairs


def without_cut_row(rows: list[Row], width: int, ended: bool) -> tuple[list[Row], list[Repair]]:
    """Drop a last row that lacks cells, or whose last cell lacks its end.

    A number cut short is still a number: without a line end, a last cell that is the beginning of
    the cell above it (51 below 512) is taken for cut.
    """
    if not rows:
        return rows, []
    line, last = rows[-1]
    cut = len(last) < width and any(len(cells) == width for _, cells in rows[-6:-1])
    if not ended and not cut and len(rows) > 1 and rows[-2][1]:
        above, cell = rows[-2][1][-1].strip(), (last[-1] if last else "").strip()
        cut = cell == "" or (cell != above and above.startswith(cell))
    if not cut:
        return rows, []
    return rows[:-1], [Repair("cut row", 1, line, "the last row is cut short: dropped")]


def usual_width(rows: Sequence[Row]) -> int:
    """Number of cells that most rows have, blank ones at the end not counted."""
    filled = [max((i + 1 for i, cell in enumerate(row) if cell.strip()), default=0)
              for _, row in rows]  # fmt: skip
    return Counter(filled).most_common(1)[0][0] if filled else 0


def without_blank_rows(rows: list[Row]) -> tuple[list[Row], list[Repair]]:
    """Leave out rows whose cells are all blank, as spreadsheets put below their tables."""
    blank = {line for line, row in rows if is_blank(row)}
    return _without(rows, blank, "blank row", "all cells blank: no row")


def without_repeated_header(rows: list[Row], header: list[str]) -> tuple[list[Row], list[Repair]]:
    """Leave out copies of the header, as a logger writes that is started again."""
    names = [name.strip() for name in header]
    again = {line for line, row in rows if len(row) == len(names) and [*map(bare, row)] == names}
    return _without(rows, again, "repeated header", "the header again: no row")


def _without(
    rows: list[Row], lines: set[int], rule: str, note: str
) -> tuple[list[Row], list[Repair]]:
    """The rows but for those of some lines, and the report of it."""
    if not lines:
        return rows, []
    kept = [row for row in rows if row[0] not in lines]
    return kept, [Repair(rule, len(lines), min(lines), note)]


def pair_decimals(rows: list[Row]) -> list[Row]:
    """Join each two cells to a number, where the comma is separator and decimal sign."""
    return [(line, [",".join(row[i : i + 2]) for i in range(0, len(row), 2)]) for line, row in rows]


def _length(row: Sequence[str], width: int) -> int:
    """Number of cells: blank ones beyond the header's are none."""
    return width if len(row) > width and is_blank(row[width:]) else len(row)


def _refuse(
    rows: list[Row], lengths: list[int], wrong: list[int], width: int, path: Path, named: str
) -> None:
    """Say what the true cause is, where one is seen; else leave it to the count of faults."""
    first = rows[wrong[0]][0]
    usual, count = Counter(lengths).most_common(1)[0]
    if _looks_decimal_comma(rows, width):
        raise RunError.at(
            path,
            f"{named} has {width} cells and rows have {2 * width}, such as "
            f"{','.join(rows[0][1])[:60]!r}: the comma separates columns and is the decimal sign",
            'add separator = "," and decimal = "," to [log]; each two cells are then one number',
            row=first,
            key="log.decimal",
        )
    start = wrong[0]
    if wrong == list(range(start, len(rows))) and start > MOST_FAULTY * len(rows):
        change = "added" if lengths[start] > width else "removed"
        raise RunError.at(
            path,
            f"the columns change here: rows have {width} cells before and {lengths[start]} from "
            f"here on, a column was {change}",
            "make a run of each part, each with its own header",
            row=first,
        )
    if usual != width and len(wrong) > len(rows) / 2:
        raise RunError.at(
            path,
            f"{named} has {width} cells, but {count} of {len(rows)} rows have {usual}",
            "correct the header so that it names every column once, or the separator",
            row=first,
        )


def _looks_decimal_comma(rows: list[Row], width: int) -> bool:
    """Whether rows have two cells for each name, all digits: 0,01,0,5 below t,x."""
    some = rows[:200]
    fitting = sum(
        len(row) == 2 * width
        and all(is_number(cell) and "." not in cell for cell in row)
        and all(cell.strip().isdigit() for cell in row[1::2])
        for _, row in some
    )
    return fitting > 0.8 * len(some)
