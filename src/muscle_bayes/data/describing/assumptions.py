"""What a run assumes because its metadata do not say it: every default, in words."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from pydantic import BaseModel

from muscle_bayes.data.describing.tables import CONVERTER_BITS
from muscle_bayes.data.run import Run
from muscle_bayes.data.sensor import ZERO_UNCERTAINTY, Sensor
from muscle_bayes.data.units import COUNTS


@dataclass(frozen=True)
class Assumption:
    """One key that the metadata leave out."""

    key: str
    """its place in NAME.toml"""
    taken: str
    """what is taken instead"""


def assumptions(run: Run) -> list[Assumption]:
    """Everything that a run's metadata leave out and that bears on this run, in their order.

    Args:
        run: as read.

    Returns:
        Key and what is taken in its stead. Keys that play no part in this rig are not listed.
    """
    metadata = run.metadata
    tables: list[tuple[str, BaseModel]] = [("", metadata)]
    for name in type(metadata).model_fields:
        if isinstance(table := getattr(metadata, name), BaseModel):
            tables.append((f"{name}.", table))
    listed = []
    for prefix, table in tables:
        for field in type(table).model_fields:
            if field in table.model_fields_set:
                continue
            said = ABSENT.get(f"{type(table).__name__}.{field}")
            side = prefix[-2:-1]  # of "element_a." and the like
            told = said(run, side) if callable(said) else said
            if told:
                listed.append(Assumption(f"{prefix}{field}", told))
    if metadata.protocol == "spring":
        listed.append(Assumption("first speed", "0, the run is released at its first row"))
    return listed


def _element(run: Run, side: str) -> Any:
    return getattr(run.metadata, f"element_{side}")


def _has_thermometer(run: Run) -> bool:
    """Whether a muscle's temperature is taken from a thermometer."""
    about = run.metadata
    muscles = [side for side in "ab" if _element(run, side).kind == "muscle"]
    return any(run.has_thermometer(s) and not about.is_heated_by_power(s) for s in muscles)


def _zero(sensor: Sensor) -> str:
    """What is taken for the uncertainty of a sensor's zero."""
    if sensor.zero_uncertainty == 0:
        return "0, exact"
    return f"{sensor.zero_uncertainty:g} {sensor.unit}, {ZERO_UNCERTAINTY:g} steps of the readings"


def _position_zero(run: Run, side: str) -> str:
    if run.imposed is not None:
        return "0, exact: the motion is imposed"
    return "" if run.unit == COUNTS or run.heated is not None else _zero(run.output_sensor)


def _is_powered(run: Run) -> bool:
    return any(run.metadata.is_heated_by_power(side) for side in "ab")


def _temperature(run: Run, side: str) -> str:
    if _element(run, side).kind != "muscle" or run.metadata.is_heated_by_power(side):
        return ""
    return f"{run.metadata.fixture.room_temperature:g} C throughout (fixture.room_temperature)"


def _where(condition: Callable[[Run], bool], told: str) -> Callable[[Run, str], str]:
    return lambda run, side: told if condition(run) else ""


def _names(key: str) -> Callable[[Run], bool]:
    """Whether [columns] names a column of this kind."""
    return lambda run: (
        run.metadata.columns is not None and (getattr(run.metadata.columns, key) is not None)
    )


def _from_text(run: Run) -> bool:
    return run.path is None or run.path.suffix.lower() not in (".parquet", ".h5", ".hdf5")


def _read_clock(run: Run, side: str) -> str:
    formats = {"hms": "HH:MM:SS, recognised", "iso": "ISO dates, recognised", "number": "numbers"}
    return formats.get(run.clock, "")


ESTIMATED: Final = "estimated, prior scaled from the run's own motion"
"""What becomes of a parameter that metadata leave open."""


def _spring(run: Run, side: str) -> str:
    """A spring's rate, pull or damping."""
    own = run.metadata.is_reference_spring(side)
    return "the thesis' reference spring's (eq. 12)" if own else ESTIMATED


def _pull(run: Run, side: str) -> str:
    stated = _element(run, side).free_length is not None
    return "as free_length has it" if stated else _spring(run, side)


def _model(run: Run, side: str) -> str:
    if not run.metadata.is_reference_spring(side):
        return ""
    return "reference: the fixture's own log names no other spring (eq. 12)"


def _closed(run: Run, side: str) -> str:
    silent = run.metadata.is_reference_spring(side) or _element(run, side).linkage == "torsion"
    return "" if silent else "none, the spring pulls at any length"


def _moment(run: Run, side: str) -> str:
    return "m g d" if _element(run, side).mass is not None else ESTIMATED


def _arm_inertia(run: Run, side: str) -> str:
    if _element(run, side).mass is not None:
        return "m d^2"
    return "part of J" if run.metadata.fixture.inertia is None else ESTIMATED


def _hanging(run: Run, side: str) -> str:
    arm = _element(run, side)
    return "0 rad" if (arm.mass or arm.moment) is not None else ESTIMATED


def _drive(run: Run, side: str) -> str:
    kind = run.metadata.drive_unit.kind
    if kind in ("force", "torque"):
        return ""
    return f"gain{', back_emf' if kind != 'current' else ''} and offset {ESTIMATED}"


def _heater(run: Run, side: str) -> str:
    powered = run.metadata.is_heated_by_power(side)
    return f"heating_rate and cooling_time {ESTIMATED}" if powered else ""


def _back_emf(run: Run, side: str) -> str:
    return ESTIMATED if run.metadata.drive_unit.kind in ("voltage", "duty") else ""


_Said = str | Callable[[Run, str], str]
_IN_COUNTS: Final = _where(lambda run: run.unit == COUNTS, "a potentiometer's raw counts")

_EVENLY: Final = "no: it changes evenly from row to row"

ABSENT: Final[dict[str, _Said]] = {
    "Metadata.thermometer": _where(_has_thermometer, "its delay is estimated, 0 +- 1 s"),
    "Metadata.columns": "the bench's own header",
    "Metadata.element_b": "none",
    "Metadata.load": _where(lambda run: not run.metadata.has_load, "nothing hangs on the rig"),
    "Metadata.drive": _drive,
    "Fixture.motion": "rotary",
    "Fixture.inertia": _where(lambda run: run.metadata.protocol != "imposed", "estimated (J)"),
    "Fixture.stops": "none",
    "Fixture.room_temperature": lambda run, side: (
        f"{run.metadata.fixture.room_temperature:g} C" if run.has_muscle else ""
    ),
    "Potentiometer.zero_uncertainty": f"{ZERO_UNCERTAINTY:g} counts",
    "Potentiometer.bits": f"{CONVERTER_BITS}, whole counts of 0 to {2**CONVERTER_BITS - 1}",
    "Potentiometer.resolution": "1 count",
    "Thermometer.delay": "estimated: 0 s within delay_uncertainty, or within 1 s",
    "Thermometer.delay_uncertainty": "0 s, the delay is exact",
    "ThermometerLog.time_unit": "s",
    "ThermometerLog.offset": "found by aligning both logs, and estimated within 5 s",
    "ThermometerLog.log": "a plain CSV",
    "LogFormat.separator": _where(_from_text, "comma (tab in .tsv and .lvm), or as the file says"),
    "LogFormat.decimal": _where(_from_text, "point"),
    "LogFormat.thousands": _where(_from_text, "none"),
    "LogFormat.skip_lines": _where(_from_text, "0"),
    "LogFormat.comment": _where(_from_text, "#"),
    "LogFormat.encoding": _where(_from_text, "UTF-8, else Latin-1"),
    "LogFormat.header": "true",
    "LogFormat.time_format": _read_clock,
    "LogFormat.group": _where(lambda run: not _from_text(run), "the file's root or only group"),
    "Columns.time_unit": _where(lambda run: run.clock == "number", "s"),
    "Columns.position_unit": _IN_COUNTS,
    "Columns.position_sign": "1",
    "Columns.position_zero": _where(lambda run: run.unit != COUNTS, "0"),
    "Columns.position_zero_uncertainty": _position_zero,
    "Columns.temperature_a": lambda run, side: _temperature(run, "a"),
    "Columns.temperature_b": lambda run, side: _temperature(run, "b"),
    "Columns.temperature_unit": _where(
        lambda run: _names("temperature_a")(run) or _names("temperature_b")(run), "degC"
    ),
    "Columns.load_unit": _where(_names("load"), "kg"),
    "Columns.power_unit": _where(_is_powered, "W"),
    "Columns.power_held": _where(_is_powered, _EVENLY),
    "Metadata.heater_a": lambda run, side: _heater(run, "a"),
    "Metadata.heater_b": lambda run, side: _heater(run, "b"),
    "Heater.heating_rate": ESTIMATED,
    "Heater.cooling_time": ESTIMATED,
    "Columns.force_unit": lambda run, side: run.metadata.force_unit if run.has_force else "",
    "Columns.force_sign": lambda run, side: "1" if run.has_force else "",
    "Columns.force_zero": lambda run, side: "0" if run.has_force else "",
    "Columns.force_zero_uncertainty": lambda run, side: (
        _zero(run.output_sensor) if run.has_force else ""
    ),
    "Columns.applied": "no known torque or force",
    "Columns.applied_unit": lambda run, side: (
        run.metadata.drive_unit.text if _names("applied")(run) else ""
    ),
    "Columns.applied_sign": _where(_names("applied"), "1"),
    "Columns.applied_held": _where(_names("applied"), _EVENLY),
    "Load.unit": "kg",
    "MuscleElement.linkage": "pins",
    "MuscleElement.heater_length": "heated over its whole length",
    "SpringElement.linkage": "pins",
    "SpringElement.model": _model,
    "SpringElement.rate": _spring,
    "SpringElement.tension_at_zero": _pull,
    "SpringElement.closed_length": _closed,
    "SpringElement.damping": _spring,
    "ArmElement.moment": _moment,
    "ArmElement.moment_of_inertia": _arm_inertia,
    "ArmElement.hanging_angle": _hanging,
    "Drive.gain": ESTIMATED,
    "Drive.offset": ESTIMATED,
    "Drive.back_emf": _back_emf,
}
"""Table and key -> what its absence means, where that bears on a run; side is that of its table."""
