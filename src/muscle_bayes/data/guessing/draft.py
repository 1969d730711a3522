"""Guess and answers -> the draft of NAME.toml."""

import numpy as np

from muscle_bayes.data.checking.column_units import contradicts
from muscle_bayes.data.guessing.answers import (
    Answers,
    element_entries,
    position_column,
    position_unit,
    time_column,
)
from muscle_bayes.data.guessing.guess import Guess
from muscle_bayes.data.guessing.roles import Column
from muscle_bayes.data.guessing.write import Draft, Entry
from muscle_bayes.data.units import POSITIONS, Unit, unit_of

_WHY = {
    "separator": "between cells",
    "decimal": "decimal sign",
    "thousands": "sign between thousands",
    "skip_lines": "lines above",
    "header": "no line names the columns: they go by number",
    "encoding": "of the text",
}


_ASSUMED = "ASSUMED: the log names no unit"


def draft_of(guess: Guess, answers: Answers) -> Draft:
    """The draft of a run's metadata. `next_question` must have nothing left to ask.

    Raises:
        RunError: an answer cannot be used.
    """
    draft = Draft()
    draft.log = [Entry(key, value, _WHY.get(key, "")) for key, value in guess.layout.keys.items()]
    time, position = time_column(guess, answers), position_column(guess, answers)
    unit = position_unit(position, answers)
    assert unit is not None, "asked for before"
    if time is None:
        said = answers.sample_rate is not None
        rate = answers.sample_rate if said else guess.layout.sample_rate
        why = "Hz, as answered" if said else "Hz, from the text above the rows"
        draft.log.append(Entry("sample_rate", float(rate or 0.0), why))
    else:
        draft.columns.append(Entry("time", time.reference, _range(time)))
        if time.clock == "number":
            said_unit = answers.time_unit or (None if time.unit is None else time.unit.text)
            why = "as answered" if answers.time_unit else "the log says so"
            why = why if said_unit else _ASSUMED
            draft.columns.append(Entry("time_unit", said_unit or "s", why))
    if position is not None:
        draft.columns.append(Entry("position", position.reference, _range(position)))
        why = "as answered" if answers.position_unit else "the log says so"
        draft.columns.append(Entry("position_unit", answers.position_unit or unit.text, why))
    used = {id(time), id(position)}
    _add_others(draft, guess, answers, used, unit.kind)
    _add_force(draft, guess, answers, used)
    _add_drive(draft, guess, used, (answers.element or "").startswith("muscle"))
    named = {entry.value for entry in draft.columns}
    others = (
        column
        for column in guess.columns
        if column.reference not in named and np.isfinite(column.values).any()
    )
    draft.unused = [f"{column.reference!r}, {_range(column)}{_serves(column)}" for column in others]
    if unit.kind == "counts" and position is not None:
        draft.potentiometer = [
            Entry("zero_reading", float(answers.zero_reading or 0.0), "counts, as answered"),
            Entry("radians_per_count", float(answers.radians_per_count or 0.0), "as answered"),
            Entry("bits", _bits(position), "the least that holds the rows looked at"),
        ]
    linear = unit.kind in ("length", "velocity")
    draft.fixture = [Entry("motion", "linear" if linear else "rotary")]
    draft.element = element_entries(answers.element or "none", unit)
    if linear and answers.load and (answers.element or "").split()[:1] == ["spring"]:
        why = "kg beside the load: nothing else moves; without this line it is estimated"
        draft.fixture.append(Entry("inertia", 0.0, why))
    if answers.load and not any(entry.key == "load" for entry in draft.columns):
        draft.load = [Entry("time", (0.0,), "s"), Entry("mass", (answers.load,), "kg")]
    accepted = _accepted(time, position, unit, answers)
    if accepted:
        draft.columns.append(Entry("accept_units", accepted, "as answered, whatever the log says"))
    return draft


def _accepted(
    time: Column | None, position: Column | None, unit: Unit, answers: Answers
) -> tuple[str, ...]:
    """Columns whose unit was answered although the log says another."""
    columns = []
    if time is not None and answers.time_unit is not None:
        stated = unit_of(answers.time_unit, ("time",))
        if stated and any(contradicts(said, stated, ("time",)) for said in time.said):
            columns.append("time")
    if answers.position_unit is not None and position is not None:
        kinds = POSITIONS["linear" if unit.kind in ("length", "velocity") else "rotary"]
        if any(contradicts(said, unit, kinds) for said in position.said):
            columns.append("position")
    return tuple(columns)


def _add_others(draft: Draft, guess: Guess, answers: Answers, used: set[int], kind: str) -> None:
    """Temperatures, load and applied force, as far as names and units say them."""
    linear = kind in ("length", "velocity")
    temperatures = [c for c in guess.likely("temperature_a") if id(c) not in used]
    ambient = [c for c in guess.likely("temperature_b") if id(c) not in used]
    for key, columns in (("temperature_a", temperatures), ("temperature_b", ambient)):
        if columns:
            draft.columns.append(Entry(key, columns[0].reference, _range(columns[0])))
    if temperatures or ambient:
        first = [*temperatures, *ambient][0]
        said = answers.temperature_unit or (None if first.unit is None else first.unit.text)
        why = "as answered" if answers.temperature_unit else "the log says so"
        draft.columns.append(Entry("temperature_unit", said or "degC", why if said else _ASSUMED))
    fits = "force" if linear else "torque"
    pulls = () if measures_force(answers) else ("force",)
    for key, roles, name, usual in (
        ("load", ("load",), "mass", "kg"),
        ("applied", ("applied", *pulls), fits, "N" if linear else "N*m"),
    ):
        columns = [c for c in guess.likely(*roles) if id(c) not in used]
        columns = [c for c in columns if c.unit is None or c.unit.kind == name]
        if key == "load" and not linear:
            columns = []  # it needs the disc's radius, which the log does not tell
        if len(columns) == 1:
            column = columns[0]
            draft.columns.append(Entry(key, column.reference, _range(column)))
            text = usual if column.unit is None else column.unit.text
            why = _ASSUMED if column.unit is None else "the log says so"
            draft.columns.append(Entry(f"{key}_unit", text, why))


def measures_force(answers: Answers) -> bool:
    """Whether a force in the log is the element's tension: what pulls on nothing is what drives."""
    return (answers.element or "none").split()[0] in ("spring", "muscle")


def _add_force(draft: Draft, guess: Guess, answers: Answers, used: set[int]) -> None:
    """What a load cell shows. Where nothing else drives, the motion is taken for imposed."""
    columns = [c for c in guess.likely("force") if id(c) not in used]
    if len(columns) != 1 or not measures_force(answers):
        return
    (column,) = columns
    text = "N" if column.unit is None else column.unit.text
    if column.unit is not None and column.unit.kind == "mass":
        text = {"g": "gf", "kg": "kgf", "lb": "lbf"}.get(text, text)
    why = f"tension of element_a; {_range(column)}; if it drives the rig: applied"
    draft.columns.append(Entry("force", column.reference, why))
    told = _ASSUMED if column.unit is None else "the log says so"
    draft.columns.append(Entry("force_unit", text, told))
    if not {entry.key for entry in draft.columns} & {"load", "applied"} and not answers.load:
        why = "the motion is as logged, the force is explained; free: both are"
        draft.protocol = Entry("protocol", "imposed", why)


def _serves(column: Column) -> str:
    """For what a column may serve that nothing chose."""
    return (
        "; may be applied (what drives) or power_a (what heats)" if column.likely == "drive" else ""
    )


def _add_drive(draft: Draft, guess: Guess, used: set[int], has_muscle: bool) -> None:
    """What is electric: of a muscle that no thermometer watches, the heater's; else a motor's.

    A power heats a muscle whatever watches it.
    """
    keys = {entry.key for entry in draft.columns}
    columns = [c for c in guess.likely("drive") if c.changes and id(c) not in used]
    power = [c for c in columns if c.unit is not None and c.unit.kind == "power"]
    heats = has_muscle and ("temperature_a" not in keys or len(power) == 1)
    columns = power if heats and len(power) == 1 else columns
    if not heats and "applied" in keys:
        return
    units = [c.unit or _electric(c) for c in columns]
    fits = [
        (column, unit)
        for column, unit in zip(columns, units, strict=True)
        if unit is not None and (heats or unit.kind != "power")
    ]
    if len(fits) != 1:
        return
    ((column, unit),) = fits
    why = _ASSUMED if column.unit is None else "the log says so"
    draft.columns.append(Entry("power_a" if heats else "applied", column.reference, _range(column)))
    draft.columns.append(Entry("power_unit" if heats else "applied_unit", unit.text, why))


def _electric(column: Column) -> Unit | None:
    """The unit that a drive's name implies: of a current A, of a voltage V, of a duty what its size is."""
    kinds = {"current": "A", "strom": "A", "voltage": "V", "spannung": "V"}
    for word, text in kinds.items():
        if word in column.name.lower():
            return unit_of(text, ("current", "voltage"))
    largest = float(np.nanmax(np.abs(column.values)))
    return unit_of("duty" if largest <= 1.0 else "percent", ("duty",)) if largest <= 100.0 else None


def _bits(column: Column) -> int:
    """Bits of the converter: the least usual number that holds the counts."""
    largest = max((value for value in column.values.tolist() if value == value), default=0.0)
    return next((bits for bits in (10, 12, 14, 16, 24) if largest < 2**bits), 32)


def _range(column: Column) -> str:
    good = column.values[column.values == column.values]
    if column.clock != "number" or not good.size:
        return "a clock"
    return f"{good.min():.6g} to {good.max():.6g} in the rows looked at"
