"""Units of a log's columns: text -> factor and offset to SI, read by pint."""

import re
from dataclasses import dataclass
from functools import cache
from math import pi
from typing import Any, Final, Literal

from muscle_bayes.conventions import GRAVITY, Motion

Kind = Literal[
    "counts",
    "time",
    "angle",
    "length",
    "angular velocity",
    "velocity",
    "temperature",
    "mass",
    "force",
    "torque",
    "current",
    "voltage",
    "duty",
    "power",
]

COUNTS: Final = "counts"
"""The position unit of a raw converter reading, which [potentiometer] turns into an angle."""

_KINDS: Final[dict[str, Kind]] = {
    "second": "time",
    "radian": "angle",
    "meter": "length",
    "radian / second": "angular velocity",
    "meter / second": "velocity",
    "kelvin": "temperature",
    "kilogram": "mass",
    "kilogram * meter / second ** 2": "force",
    "kilogram * meter ** 2 / second ** 2": "torque",
    "ampere": "current",
    "kilogram * meter ** 2 / ampere / second ** 3": "voltage",
    "dimensionless": "duty",
    "kilogram * meter ** 2 / second ** 3": "power",
}
_ALIASES: Final[dict[Kind, dict[str, str]]] = {
    "time": {
        "sec": "s",
        "secs": "s",
        "msec": "ms",
        "msecs": "ms",
        "usec": "us",
        "mins": "min",
        "sek": "s",
    },
    "angle": {"°": "deg", "degs": "deg", "rev": "turn", "revs": "turn", "revolutions": "turn"},
    "angular velocity": {
        "°/s": "deg/s",
        "dps": "deg/s",
        "rev/s": "turn/s",
        "rev/min": "turn/min",
        "rps": "turn/s",
    },
    "temperature": {
        "c": "degC",
        "°c": "degC",
        "deg c": "degC",
        "degc": "degC",
        "celsius": "degC",
        "f": "degF",
        "°f": "degF",
        "deg f": "degF",
        "degf": "degF",
        "fahrenheit": "degF",
        "k": "kelvin",
        "kelvin": "kelvin",
    },
    "mass": {"kgs": "kg", "lbs": "lb"},
    "duty": {"1": "duty", "%": "percent", "pwm": "duty"},
    "torque": {
        "nm": "N*m",
        "n.m": "N*m",
        "n-m": "N*m",
        "n m": "N*m",
        "mnm": "mN*m",
        "ncm": "N*cm",
        "nmm": "N*mm",
        "kgcm": "kgf*cm",
        "kg*cm": "kgf*cm",
    },
}
_COMMON: Final[dict[str, tuple[Kind, float, float]]] = {
    "s": ("time", 1.0, 0.0),
    "ms": ("time", 1e-3, 0.0),
    "rad": ("angle", 1.0, 0.0),
    "deg": ("angle", pi / 180.0, 0.0),
    "m": ("length", 1.0, 0.0),
    "mm": ("length", 1e-3, 0.0),
    "rad/s": ("angular velocity", 1.0, 0.0),
    "m/s": ("velocity", 1.0, 0.0),
    "degC": ("temperature", 1.0, 0.0),
    "kg": ("mass", 1.0, 0.0),
    "N": ("force", 1.0, 0.0),
    "N*m": ("torque", 1.0, 0.0),
    "A": ("current", 1.0, 0.0),
    "V": ("voltage", 1.0, 0.0),
    "W": ("power", 1.0, 0.0),
    "duty": ("duty", 1.0, 0.0),
    "percent": ("duty", 0.01, 0.0),
}
"""Known without pint, whose import takes a third of a second."""
_AMBIGUOUS: Final = ("grad", "c")
"""Degrees in German and gradians elsewhere; the speed of light to pint: never a column's unit."""
_PLAIN: Final = re.compile(r"[A-Za-z°%_/*^ .0-9()-]{1,40}")
_LONG_NUMBER: Final = re.compile(r"\d\d|\*\*.*\*\*|\^.*\^")

EXAMPLES: Final[dict[Kind, str]] = {
    "counts": "counts",
    "time": "s, ms, us, min, h",
    "angle": "rad, mrad, deg, rev",
    "length": "m, cm, mm, um, inch",
    "angular velocity": "rad/s, deg/s, rpm",
    "velocity": "m/s, mm/s",
    "temperature": "degC, kelvin, degF",
    "mass": "kg, g, lb",
    "force": "N, mN, gf, kgf, lbf",
    "torque": "N*m, N*cm, mN*m, kgf*cm",
    "current": "A, mA",
    "voltage": "V, mV",
    "duty": "duty, percent",
    "power": "W, mW",
}
"""Units of each kind that messages may show."""
SI_OF_DRIVE: Final[dict[Kind, str]] = {
    "force": "N",
    "torque": "N m",
    "current": "A",
    "voltage": "V",
    "duty": "of whole duty",
    "power": "W",
}
"""In what the table of a run holds what drives or heats it."""

POWERS: Final[tuple[Kind, ...]] = ("power", "current", "voltage", "duty")
"""What may heat a muscle."""
POSITIONS: Final[dict[Motion, tuple[Kind, ...]]] = {
    "rotary": ("counts", "angle", "angular velocity"),
    "linear": ("length", "velocity"),
}
"""What a position column of a rig may hold."""
DRIVES: Final[dict[Motion, tuple[Kind, ...]]] = {
    "rotary": ("torque", "current", "voltage", "duty"),
    "linear": ("force", "current", "voltage", "duty"),
}
"""What a drive column of a rig may hold: its force first."""
ALL_POSITIONS: Final[tuple[Kind, ...]] = (
    "counts",
    "angle",
    "length",
    "angular velocity",
    "velocity",
)


@dataclass(frozen=True)
class Unit:
    """A unit: value in SI (temperatures in degrees C) = factor * number + offset."""

    text: str
    kind: Kind
    factor: float
    offset: float = 0.0

    def same(self, other: "Unit") -> bool:
        """Whether numbers in both units mean the same."""
        return (
            self.kind == other.kind
            and abs(self.factor - other.factor) <= 1e-9 * abs(other.factor)
            and abs(self.offset - other.offset) <= 1e-6
        )


def examples(kinds: tuple[Kind, ...]) -> str:
    """Units of these kinds, for a message."""
    return ", ".join(EXAMPLES[kind] for kind in kinds)


def unit_of(text: str, kinds: tuple[Kind, ...]) -> Unit | None:
    """The unit that `text` names, of one of `kinds`; None where it names none of them.

    Aliases that mean something else elsewhere (C, F, Nm, rev) hold only among their own kind, and a
    mass may be given as a weight (N, gf): it is divided by the standard acceleration of gravity.
    """
    clean = _clean(text)
    if "counts" in kinds and clean == COUNTS:
        return Unit(COUNTS, "counts", 1.0)
    for kind in kinds:
        alias = _ALIASES.get(kind, {})
        if (known := alias.get(clean.lower())) is not None:
            return _parsed(known, text)
    if clean.lower() in _AMBIGUOUS:
        return None
    parsed = _parsed(clean, text)
    if parsed is None or parsed.kind in kinds:
        return parsed
    if parsed.kind == "force" and "mass" in kinds:
        return Unit(text, "mass", parsed.factor / GRAVITY)
    return None


def stated_unit(key: str, text: str, kinds: tuple[Kind, ...]) -> Unit:
    """The unit that a key of the metadata states. Raises ValueError where it names none of `kinds`."""
    unit = unit_of(text, kinds)
    if unit is None:
        raise ValueError(
            f"{key}: {text!r} is no unit of {' or '.join(kinds)}; give one such as {examples(kinds)}"
        )
    return unit


def any_unit(text: str) -> Unit | None:
    """The unit that `text` names, of whatever kind that a log has a column of."""
    clean = _clean(text)
    if clean.lower() in _AMBIGUOUS:
        return None
    return _parsed(clean, text) or unit_of(text, tuple(_ALIASES))


def is_unit(text: str) -> bool:
    """Whether `text` names a unit of anything at all, volts and pascals included."""
    return any_unit(text) is not None or _quantity(_clean(text)) is not None


def _clean(text: str) -> str:
    return re.sub("[µμ]", "u", text.strip()).replace("·", "*")


@cache
def _registry() -> Any:
    import pint  # takes a third of a second, and most commands read no unit but the default

    return pint.UnitRegistry()


@cache
def _quantity(text: str) -> Any:
    """One of the unit as pint has it; None where pint knows no such unit."""
    if not _PLAIN.fullmatch(text) or _LONG_NUMBER.search(text) or not re.search("[A-Za-z°]", text):
        return None
    try:
        return _registry().Quantity(1.0, _registry().parse_units(text))
    except (
        Exception
    ):  # pint raises what its tokenizer, its parser and Python's own arithmetic raise
        return None


@cache
def _parsed(clean: str, text: str) -> Unit | None:
    if (common := _COMMON.get(clean)) is not None:
        return Unit(text, *common)
    quantity = _quantity(clean)
    if quantity is None or "delta" in str(quantity.units):
        return None
    try:
        base = quantity.to_base_units()
        kind = _KINDS.get(str(base.units))
        if kind is None:
            return None
        if kind != "temperature":
            return Unit(text, kind, float(base.magnitude))
        registry = _registry()
        zero, one = (
            float(registry.Quantity(value, quantity.units).to("degC").magnitude)
            for value in (0.0, 1.0)
        )
        return Unit(text, kind, one - zero, zero)
    except Exception:  # units that cannot be converted, such as decibels
        return None
