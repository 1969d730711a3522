"""Small tables for notebooks and terminals."""

import re
from collections.abc import Iterable, Sequence
from html import escape
from math import floor, log10

RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def unit_of(text: str) -> str:
    """A unit as it is set: powers raised."""
    return re.sub(r"\^(-?\d+)", lambda power: power[1].translate(RAISED), text)


def html_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """An HTML table of plain texts, which are escaped."""
    head = "".join(f"<th>{escape(name)}</th>" for name in header)
    body = "".join(
        f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def plain_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Lines of text: the first two columns to the left, numbers to the right."""
    lines = [tuple(header), *(tuple(row) for row in rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if column < 2 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def three_digits(value: float) -> str:
    """A number with three significant digits."""
    if not 1e-4 <= abs(value) < 1e6:
        return f"{value:.3g}"
    decimals = 2 - floor(log10(abs(float(f"{value:.2e}"))))
    return f"{round(value, decimals):.{max(decimals, 0)}f}"
