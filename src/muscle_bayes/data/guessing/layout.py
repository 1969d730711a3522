"""Layout of a text log, guessed: separator, decimal sign, header, lines above it."""

import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from muscle_bayes.data.errors import RunError
from muscle_bayes.data.reading.cells import is_number, numbers
from muscle_bayes.data.reading.header import bare, is_units_row
from muscle_bayes.data.reading.lvm import is_lvm
from muscle_bayes.data.reading.preamble import SEPARATOR_LINE, without_comments
from muscle_bayes.data.reading.rows import Row, parse_rows
from muscle_bayes.data.reading.text import decode, split_lines

_SEPARATORS: Final = (",", ";", "\t", "|", " ")
_DECIMALS: Final[dict[str, tuple[tuple[str, str | None], ...]]] = {
    ",": ((".", None), (".", ","), (",", None), (",", ".")),
    ";": ((".", None), (",", None), (",", "."), (".", ",")),
}
_OTHER: Final = ((".", None), (",", None), (".", ","), (",", "."))
_TIME = re.compile(
    r"(\d{1,4}:)?\d{1,2}:\d{1,2}([.,]\d*)?|\d{4}-\d\d-\d\d([T ].*)?|\d{1,2}([./])\d{1,2}\4\d{2,4}"
)
_LOOKED_AT: Final = 400
"""Lines that tell the layout."""
_ROWS: Final = 20_000
"""Most lines whose numbers are looked at."""
_WORDS: Final = {"\t": "tab", " ": "space"}
_RATE = re.compile(r"(sampl\w*[_ ]?(rate|freq\w*)|fs|rate|frequency)\W*", re.IGNORECASE)
_KEY_VALUE = re.compile(r"^\W*([A-Za-z][\w ]*?)\s*(?:\([^)]*\))?\s*[:=]\s*([-+0-9.eE]+)\s*(\w*)")


@dataclass
class Layout:
    """What the text tells of itself."""

    keys: dict[str, str | int | float | bool] = field(default_factory=dict)
    """keys of [log] that differ from a plain CSV's"""
    header: list[str] = field(default_factory=list)
    """names of the columns; empty where the log has none"""
    units_row: list[str] = field(default_factory=list)
    rows: list[Row] = field(default_factory=list)
    """the rows looked at"""
    width: int = 1
    above: list[str] = field(default_factory=list)
    """text above the header"""
    sample_rate: float | None = None
    """rows per second, if the text above says it"""


def guess_layout(content: bytes, path: Path) -> Layout:
    """Layout of a text log.

    Args:
        content: the file's bytes.
        path: serves the messages and says the kind.

    Raises:
        RunError: nothing in it looks like rows of numbers.
    """
    layout = Layout()
    encoding = "utf-16" if content.startswith((b"\xff\xfe", b"\xfe\xff")) else None
    if encoding is not None:
        layout.keys["encoding"] = encoding
    text, _ = decode(content, path, encoding)
    lines = [(n, line.strip("\0")) for n, line in enumerate(split_lines(text), 1)]
    lines = [(n, line) for n, line in lines if line.strip()]
    if not lines:
        raise RunError.at(path, "the log is empty", "give the log with its rows")
    said = SEPARATOR_LINE.fullmatch(lines[0][1])
    lines = lines[1:] if said else lines
    plain = [(n, line) for n, line in lines if not line.lstrip().startswith("#")]
    body = plain[-_LOOKED_AT:] if len(plain) > _LOOKED_AT else plain[len(plain) // 4 :]
    separator, decimal, thousands, width = _best(body, said[1] if said else None, path)
    usual = "\t" if path.suffix.lower() in (".tsv", ".lvm") or is_lvm(content) else ","
    if separator is not None and separator != (said[1] if said else usual):
        layout.keys["separator"] = _WORDS.get(separator, separator)
    _find_header(layout, plain, lines, separator or usual, decimal, width, path)
    if decimal == "," or _is_paired(layout, separator):
        layout.keys["decimal"] = ","
        if separator == ",":
            layout.keys["separator"] = ","
    if thousands is not None:
        layout.keys["thousands"] = thousands
    layout.sample_rate = _stated_rate(layout.above)
    return layout


def decimal_of(layout: Layout) -> tuple[str, str | None]:
    """Decimal sign and sign between thousands."""
    thousands = layout.keys.get("thousands")
    return str(layout.keys.get("decimal", ".")), None if thousands is None else str(thousands)


def _best(
    body: list[tuple[int, str]], said: str | None, path: Path
) -> tuple[str | None, str, str | None, int]:
    """Separator (None = one column), decimal sign, sign between thousands, number of cells."""
    best: tuple[float, str | None, str, str | None, int] = (0.0, None, ".", None, 1)
    for separator in (said,) if said else _SEPARATORS:
        rows, _ = parse_rows(body, separator)
        width, share = _usual(rows)
        for decimal, thousands in _DECIMALS.get(separator, _OTHER):
            if separator == "," and decimal == ",":
                continue  # pairs are recognised by the header
            good = _readable(rows, width, decimal, thousands)
            # More columns are better where as much can be read; plain numbers before grouped ones.
            score = share * good + 0.02 * (width > 1) - 0.001 * (thousands is not None)
            if score > best[0] + 1e-9:
                best = (score, separator if width > 1 else None, decimal, thousands, width)
    if best[0] < 0.4:
        raise RunError.at(
            path,
            "no rows of numbers are found in it",
            "give a text log of rows with the same number of cells",
        )
    return best[1], best[2], best[3], best[4]


def _usual(rows: list[Row]) -> tuple[int, float]:
    """Number of cells that most rows have, and the share of rows that have it."""
    if not rows:
        return 1, 0.0
    width, count = Counter(len(row) for _, row in rows).most_common(1)[0]
    return max(width, 1), count / len(rows)


def _readable(rows: list[Row], width: int, decimal: str, thousands: str | None) -> float:
    """Share of cells that hold numbers, times of day or nothing."""
    cells = [cell for _, row in rows if len(row) == width for cell in row if cell.strip()]
    if not cells:
        return 0.0
    values = numbers(cells, decimal, thousands)
    good = sum(
        value == value or bool(_TIME.fullmatch(cell.strip().strip('"')))
        for cell, value in zip(cells, values.tolist(), strict=True)
    )
    return good / len(cells)


def _find_header(
    layout: Layout,
    plain: list[tuple[int, str]],
    lines: list[tuple[int, str]],
    separator: str,
    decimal: str,
    width: int,
    path: Path,
) -> None:
    """Header, units row, first row and the lines above."""
    rows = [parse_rows([line], separator)[0] for line in plain[:_ROWS]]
    flat = [
        (n, cells[0][1] if cells else [line]) for (n, line), cells in zip(plain, rows, strict=False)
    ]
    first = next(
        (at for at, (_, cells) in enumerate(flat) if _is_data(cells, width, decimal)), len(flat)
    )
    if first == len(flat):
        raise RunError.at(
            path,
            f"no row of numbers is found: the last line is {plain[-1][1][:60]!r}",
            "give a log of rows whose cells are numbers or times",
        )
    at = first - 1
    if at >= 1 and len(flat[at - 1][1]) == len(flat[at][1]) and is_units_row(flat[at][1]):
        layout.units_row = flat[at][1]
        at -= 1
    names = [bare(cell) for cell in flat[at][1]] if at >= 0 else []
    _, _, hidden = without_comments(lines, "#", separator, None) if at < 0 else (None, None, None)
    while len(names) > width and not names[-1]:
        names.pop()
    if width == 1 and names and _KEY_VALUE.match(names[0]):
        names = []  # "rate: 50 Hz" is a setting, no name
    fits = len(names) == width or (width % 2 == 0 and len(names) == width // 2)
    if names and fits and any(names) and not all(map(is_number, filter(None, names))):
        layout.header = names
        top = flat[at][0]
    elif hidden is not None:
        layout.header, top = [bare(cell) for cell in hidden[1]], 1
    else:
        layout.keys["header"] = False
        top, layout.units_row = flat[first][0], []
    above = [(n, line) for n, line in plain if n < top]
    if above:
        layout.keys["skip_lines"] = top - 1
    layout.above = [line for n, line in lines if n < top]
    layout.rows = [row for row in flat[first:] if len(row[1]) == width]
    layout.width = width


def _is_data(cells: list[str], width: int, decimal: str) -> bool:
    filled = [cell for cell in cells if cell.strip()]
    good = sum(
        is_number(cell, decimal) or is_number(cell) or bool(_TIME.fullmatch(cell.strip()))
        or bool(re.fullmatch(r"[-+]?\d{1,3}([,.' ]\d{3})+([.,]\d*)?", cell.strip()))
        for cell in filled
    )  # fmt: skip
    return len(cells) == width and bool(filled) and good == len(filled)


def _is_paired(layout: Layout, separator: str | None) -> bool:
    """Whether the comma separates columns and is the decimal sign: half as many names as cells."""
    return (
        separator == ","
        and bool(layout.header)
        and layout.width == 2 * len(layout.header)
        and all(cell.strip().isdigit() for _, row in layout.rows[:50] for cell in row[1::2])
    )


def _stated_rate(above: list[str]) -> float | None:
    """Rows per second, from `sample rate: 100 Hz` or from a row of names and one of values."""
    for at, line in enumerate(above):
        if (pair := _KEY_VALUE.match(line)) and _RATE.fullmatch(pair[1].strip()):
            value = numbers([pair[2]])[0]
            return float(value) * (1000.0 if pair[3].lower() == "khz" else 1.0)
        names = [bare(cell) for cell in re.split(r"[,;\t]", line)]
        if at + 1 < len(above):
            values = [bare(cell) for cell in re.split(r"[,;\t]", above[at + 1])]
            for name, value in zip(names, values, strict=False):
                if _RATE.fullmatch(name) and is_number(value):
                    return float(value)
    return None
