"""Numbers as a reader wants them."""

from collections.abc import Mapping
from typing import Any

from muscle_bayes.markup import RAISED

MINUS = "−"


def number(value: float | None, digits: int = 4) -> str:
    """A number to so many significant digits; powers of ten where it is very small or large."""
    if value is None:
        return "unknown"
    if value == 0.0:
        return "0"
    size = abs(value)
    if 1e-3 <= size < 1e5:
        text = f"{value:#.{digits}g}".rstrip(".")
        text = text if "e" not in text else f"{value:.0f}"
        return text.replace("-", MINUS)
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}·10{str(int(exponent)).translate(RAISED)}".replace("-", MINUS)


def interval(row: Mapping[str, Any], digits: int = 4) -> str:
    """The central 90 %."""
    return f"{number(row['q05'], digits)} to {number(row['q95'], digits)}"


def percent(share: float) -> str:
    """A share in percent."""
    return f"{100.0 * share:.0f} %"


def plural(count: int, noun: str) -> str:
    """Count and noun."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
