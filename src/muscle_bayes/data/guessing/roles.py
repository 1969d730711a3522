"""What the columns of a log hold, guessed from their names, units and numbers."""

import re
from dataclasses import dataclass
from typing import Final

import numpy as np

from muscle_bayes.data.checking.column_units import meant_unit
from muscle_bayes.data.reading.clock_formats import read_times
from muscle_bayes.data.reading.header import SaidUnit, unit_in_name, unit_in_row, without_unit
from muscle_bayes.data.units import EXAMPLES, Kind, Unit, any_unit, unit_of

_NAMES: Final[tuple[tuple[str, str], ...]] = (
    (
        "time",
        r"t|t_(s|sec|ms|us|min)|time\w*|timestamp|zeit|temps|tiempo|elapsed\w*|clock|date\w*|seconds|millis",
    ),
    ("temperature_b", r"(ambient|room|raum|air)\w*"),
    (
        "temperature_a",
        r"temp\w*|t\d|.*temperatur\w*|celsius|heat\w*|.*muscle.*_c|t_\w+|tc\d*|thermo\w*|pt100\d*|ntc\d*",
    ),
    (
        "applied",
        r"(applied|drive\w*|motor)?_?(torque|drehmoment|tau)\w*|(applied|drive\w*|motor)_?(force|kraft)\w*",
    ),
    ("force", r"(.*_)?(force|kraft|tension|pull|(load_?)?cell|kraftdose)\w*"),
    ("load", r"load\w*|mass\w*|weight|masse|last"),
    ("drive", r"(.*_)?(current|strom|voltage|spannung|pwm|duty|power|leistung|heater)\w*"),
    (
        "index",
        r"(n|nr|no|idx|index|sample|row|record|frame|line)(_?(n|nr|no|num|number|index|id))?",
    ),
    (
        "position",
        r"(.*_)?(pos\w*|angle\w*|angular_position|winkel\w*|theta\w*|phi|x|y|q|disp\w*|weg|hoehe"
        r"|height|travel|stroke|length|extension|enc\w*|pot\w*|weight_raised|deg|rad)\w*",
    ),
    ("velocity", r"(.*_)?(angular_velocity|velocity|vel|omega|speed|gyro\w*|rate|v|w)\w*"),
)
_KINDS: Final[dict[str, tuple[Kind, ...]]] = {
    "time": ("time",),
    "temperature_a": ("temperature",),
    "temperature_b": ("temperature",),
    "applied": ("force", "torque"),
    "force": ("force", "torque", "mass"),
    "drive": ("current", "voltage", "duty", "power"),
    "load": ("mass",),
    "position": ("angle", "length"),
    "velocity": ("angular velocity", "velocity"),
}
_ROLE_OF: Final[dict[Kind, str]] = {
    "time": "time",
    "angle": "position",
    "length": "position",
    "angular velocity": "velocity",
    "velocity": "velocity",
    "temperature": "temperature_a",
    "mass": "load",
    "force": "force",
    "torque": "applied",
    "current": "drive",
    "voltage": "drive",
    "power": "drive",
}

_PLAIN_SUFFIXES: Final = frozenset(
    text
    for kind in _ROLE_OF
    if kind != "time"
    for text in EXAMPLES[kind].split(", ")
    if len(text) > 1
) | {"volt", "volts", "amp", "amps", "watt", "watts"}
"""Units that the end of any name may say, as laser_um does."""
_LETTERS: Final = {"V": False, "W": False, "A": True, "N": True}
"""Units of one letter, and whether only brackets or a units row make one of it: coil A may be side A."""
_WEIGHTS: Final = 20
"""A load of more different values than this was measured by a cell: weights are hung and taken off."""


@dataclass
class Column:
    """One column of a log."""

    number: int
    """from 1"""
    name: str
    """of the header; empty where there is none"""
    values: np.ndarray
    """numbers of the rows looked at; NaN where there is none"""
    clock: str
    """how it reads as a time"""
    likely: str
    """what it seems to hold: a name of _NAMES (index: it numbers the rows), or nothing"""
    unit: Unit | None
    """what its name or the units row says"""
    said: list[SaidUnit]
    """all that they say"""
    changes: bool
    rises: bool

    @property
    def reference(self) -> str | int:
        """How NAME.toml names it."""
        return self.name or self.number


def describe_columns(
    header: list[str],
    units_row: list[str],
    cells: list[tuple[str, ...]],
    decimal: str,
    thousands: str | None,
) -> list[Column]:
    """Columns with what they seem to hold.

    Args:
        header: names, empty where the log has none.
        units_row: cells of a units row, if there is one.
        cells: text of each column.
        decimal: decimal sign.
        thousands: sign between thousands.
    """
    columns = []
    for at, column in enumerate(cells):
        name = header[at] if at < len(header) else ""
        times = read_times(column, None, decimal, thousands)
        values = times.values
        good = values[np.isfinite(values)]
        above = unit_in_row(units_row[at]) if at < len(units_row) else []
        said = [*above, *(unit_in_name(name) if name else [])]
        likely, unit = _role(name, said)
        with np.errstate(over="ignore", invalid="ignore"):
            steps = np.diff(good)
        if times.kind != "number":
            likely, unit = "time", None
        if likely == "load" and np.unique(good).size > _WEIGHTS:
            likely = "force"
        columns.append(
            Column(
                at + 1,
                name if header.count(name) == 1 else "",
                values,
                times.kind,
                likely,
                unit,
                said,
                bool(good.size > 1 and np.ptp(good) > 0),
                bool(steps.size > 1 and np.mean(steps > 0) > 0.95 and good[-1] > good[0]),
            )
        )
    return columns


def _role(name: str, said: list[SaidUnit]) -> tuple[str, Unit | None]:
    short = re.sub(r"[^a-z0-9]+", "_", without_unit(name).lower()).strip("_")
    roles = [role for role, pattern in _NAMES if re.fullmatch(pattern, short)]
    # t is the time, T the temperature; and chamber_C is one
    if without_unit(name) == "T" or re.fullmatch(r"\w+[_ ](deg)?C", name):
        roles = ["temperature_a"]
    for role in roles:
        for one in said:
            unit = meant_unit(one, _KINDS.get(role, ())) or _letter(one)
            if unit is not None and unit.kind in _KINDS.get(role, ()):
                return role, unit
    for one in said:
        if not one.sure and one.text not in _PLAIN_SUFFIXES:
            continue
        unit = any_unit(one.text) if len(one.text) > 1 else _letter(one)
        if unit is not None and unit.kind in _ROLE_OF:
            return _ROLE_OF[unit.kind], unit
    if not roles and len(name) > 1:  # a column that goes by its unit alone: ms, deg
        for role, kinds in _KINDS.items():
            if (unit := unit_of(name, kinds)) is not None:
                return role, unit
    return (roles[0] if roles else ""), None


def _letter(said: SaidUnit) -> Unit | None:
    """The unit of one letter that is said."""
    needs_sure = _LETTERS.get(said.text)
    return None if needs_sure is None or needs_sure > said.sure else any_unit(said.text)
