"""What each effect of the catalogue says of itself: for the command line and the documentation."""

import inspect
import re
import sys
from typing import NamedTuple

from muscle_bayes.physics.effects import CATALOGUE, effect_type


class EffectText(NamedTuple):
    """An effect in words."""

    name: str
    port: str
    what: str
    """what it does, in one sentence without the full stop"""
    equation: str
    symbols: str
    """what the equation's symbols mean"""
    source: str
    parameters: tuple[tuple[str, str, str], ...]
    """name, unit and meaning of each"""


def described(name: str) -> EffectText:
    """An effect of the catalogue or of the user's own in words. Raises MuscleBayesError."""
    effect = effect_type(name)
    equation, _, rest = (inspect.getdoc(effect) or "").partition("\n\n")
    symbols, _, source = _line(rest).partition("Source: ")
    about = getattr(sys.modules.get(effect.__module__), "__doc__", None)
    return EffectText(
        name=name,
        port=effect.port,
        what=_line(about or "").rstrip("."),
        equation=_line(equation),
        symbols=symbols.strip(),
        source=source.strip().rstrip("."),
        parameters=tuple((key, one.unit, one.meaning) for key, one in effect.parameters.items()),
    )


def catalogue() -> list[EffectText]:
    """All effects of the catalogue, by name."""
    return [described(name) for name in sorted(CATALOGUE)]


def _line(text: str) -> str:
    return re.sub(r"\s+", " ", text).strip()
