"""The [columns] table: which columns a log has, and their units."""

from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator, PlainValidator, model_validator

from muscle_bayes.conventions import Motion
from muscle_bayes.data.describing.elements import Table, as_tuple
from muscle_bayes.data.describing.sizes import Finite, NonNegative
from muscle_bayes.data.units import (
    ALL_POSITIONS,
    COUNTS,
    DRIVES,
    POSITIONS,
    POWERS,
    Kind,
    stated_unit,
)


def _checked(value: Any) -> str | int:
    if isinstance(value, str) and value.strip():
        return value
    if isinstance(value, int) and not isinstance(value, bool) and value >= 1:
        return value
    raise ValueError(
        f": {value!r} names no column; give the header's name, or the column's number from 1 on"
    )


ColumnName = Annotated[str | int, PlainValidator(_checked)]
"""The header's text, or the number of the column, the first being 1."""


def column_label(name: str | int) -> str:
    """How messages call a column."""
    return f"column {name}" if isinstance(name, int) else name.strip().strip('"').strip()


COLUMN_KEYS: Final = (
    "time",
    "position",
    "temperature_a",
    "temperature_b",
    "power_a",
    "power_b",
    "load",
    "force",
    "applied",
)
"""Keys that name a column."""

Quantity = Literal["time", "position", "temperature_a", "temperature_b", "load", "applied"]
"""What a named column may hold."""

_UNITS: dict[str, tuple[Kind, ...]] = {
    "time_unit": ("time",),
    "position_unit": ALL_POSITIONS,
    "temperature_unit": ("temperature",),
    "load_unit": ("mass",),
    "power_unit": POWERS,
    "force_unit": ("force", "torque"),
    "applied_unit": ("force", "torque", "current", "voltage", "duty"),
}


class Columns(Table):
    """Columns of a log, and their units, where they are not the bench's own."""

    time: ColumnName | None = None
    """absent only where [log] gives a sample_rate"""
    time_unit: str | None = None
    """absent = s"""
    position: ColumnName | None = None
    """the measured output: a position, or a velocity where position_unit is one; absent only where a
    force is measured of an element that is held"""
    position_unit: str = COUNTS
    """counts, or a unit of angle, length, or the velocity of either"""
    position_sign: Literal[1, -1] = 1
    position_zero: Finite | None = None
    """reading at coordinate zero, in position_unit; absent = 0"""
    position_zero_uncertainty: NonNegative | None = None
    """standard uncertainty of that, in position_unit; absent = exact"""
    temperature_a: ColumnName | None = None
    temperature_b: ColumnName | None = None
    temperature_unit: str | None = None
    """of both; absent = degC"""
    power_a: ColumnName | None = None
    """what heats element_a: power, current, voltage or duty of the heater, which [heater_a] turns into a
    temperature; that of temperature_a is then a measured output"""
    power_b: ColumnName | None = None
    power_unit: str | None = None
    """of both; absent = W"""
    power_held: bool = False
    """whether a power holds until the next row, as a command does"""
    load: ColumnName | None = None
    """mass that hangs on the rig, instead of [load]"""
    load_unit: str | None = None
    """absent = kg; a unit of force is taken for the weight"""
    force: ColumnName | None = None
    """measured tension of element_a: force of a load cell, or its torque where it has no length"""
    force_unit: str | None = None
    """absent = N, or N*m of a torsion spring or an arm"""
    force_sign: Literal[1, -1] = 1
    """-1 where a tension reads negative"""
    force_zero: Finite | None = None
    """reading of no force, in force_unit; absent = 0"""
    force_zero_uncertainty: NonNegative | None = None
    """standard uncertainty of that, in force_unit; absent = exact"""
    applied: ColumnName | None = None
    """what drives the rig: a known torque (force where motion is linear), or the current, voltage or
    duty of a motor, which [drive] turns into one"""
    applied_unit: str | None = None
    """absent = N*m, or N where motion is linear"""
    applied_sign: Literal[1, -1] = 1
    """-1 where a positive drive pulls against the coordinate"""
    applied_held: bool = False
    """whether a value holds until the next row, as a command does"""
    accept_units: Annotated[tuple[Quantity, ...], BeforeValidator(as_tuple)] = ()
    """columns whose unit is right although the header or the numbers speak against it"""

    @model_validator(mode="after")
    def _units_are_known(self) -> "Columns":
        for key, kinds in _UNITS.items():
            text = getattr(self, key)
            if text is not None:
                stated_unit(key, text, kinds)
        return self

    @model_validator(mode="after")
    def _position_is_described_once(self) -> "Columns":
        if self.time is not None and self.time == self.position:
            raise ValueError(
                f"position: names the same column as time, {self.time!r}; name the position's own"
            )
        if self.position_unit == COUNTS:
            for key, own in (
                ("position_zero", "zero_reading"),
                ("position_zero_uncertainty", "zero_uncertainty"),
            ):
                if getattr(self, key) is not None:
                    raise ValueError(
                        f"{key}: is for positions that are not in counts; use potentiometer.{own}"
                    )
        return self


HEATER_HEADER: Final = ("Duty A", "Duty B", "Faults", "Fan")
"""Duty of each heater, of 255, the board's latched faults and its fan (0 or 1), as the board said last
before the row; blank while it did not answer."""

HEATER_COLUMNS: Final = ("duty_a", "duty_b", "faults", "fan")
"""Their names in a run's table; NaN where a cell is blank or the log has no such column."""


def column_kinds(column: str, motion: Motion, has_torque: bool) -> tuple[tuple[Kind, ...], str]:
    """What a run's column may hold on such a rig, and its unit where none is stated."""
    known: dict[str, tuple[tuple[Kind, ...], str]] = {
        "time": (("time",), "s"),
        "reading": (POSITIONS[motion], COUNTS),
        "load": (("mass",), "kg"),
        "force": (("torque",), "N*m") if has_torque else (("force",), "N"),
        "power_a": (POWERS, "W"),
        "power_b": (POWERS, "W"),
        "applied": (DRIVES[motion], "N" if motion == "linear" else "N*m"),
    }
    return known.get(column, (("temperature",), "degC"))
