"""The unit of each column: what the metadata say against what the log says."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from muscle_bayes.data.describing.metadata import Metadata
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.log import RawLog
from muscle_bayes.data.reading.header import SaidUnit
from muscle_bayes.data.units import (
    Kind,
    Unit,
    any_unit,
    examples,
    is_unit,
    unit_of,
)

_KEYS: Final = {
    "time": "time_unit",
    "reading": "position_unit",
    "temperature_a": "temperature_unit",
    "temperature_b": "temperature_unit",
    "load": "load_unit",
    "force": "force_unit",
    "power_a": "power_unit",
    "power_b": "power_unit",
    "applied": "applied_unit",
}
_LETTERS: Final[dict[str, str]] = {
    "time": "shd",
    "angle": "°",
    "length": "m",
    "temperature": "cfkCFK",
    "mass": "g",
    "force": "N",
}
"""Units of one letter that stand behind a name."""
_ACCEPTED: Final = {"reading": "position"}


@dataclass(frozen=True)
class ColumnUnit:
    """The unit in which a column is read, and how sure that is."""

    unit: Unit
    key: str
    """key of [columns] that states it"""
    stated: bool
    """whether the metadata state it"""
    confirmed: bool
    """whether the log says the same, in brackets or in a units row"""
    accepted: bool
    """whether the metadata say that it is right whatever speaks against it"""


def column_units(raw: RawLog, metadata: Metadata) -> dict[str, ColumnUnit]:
    """Unit of each column of a log.

    A name or a units row that says another unit than the metadata is an error, never a guess.

    Raises:
        RunError: the log says another unit; names the key that settles it.
    """
    return {key: _unit(key, raw, metadata) for key in raw.cells if key in _KEYS}


def _unit(key: str, raw: RawLog, metadata: Metadata) -> ColumnUnit:
    columns, (kinds, usual) = metadata.columns, metadata.kinds_of(key)
    stated = None if columns is None else getattr(columns, _KEYS[key])
    is_stated = stated is not None and (
        columns is not None and _KEYS[key] in columns.model_fields_set
    )
    text = stated or usual
    unit = unit_of(text, kinds)
    assert unit is not None, "Metadata guarantees units that fit"
    accepted = columns is not None and _ACCEPTED.get(key, key) in columns.accept_units
    confirmed = False
    for said in [] if accepted else raw.said_units.get(key, []):
        meant = meant_unit(said, kinds)
        if contradicts(said, unit, kinds):
            _refuse(key, unit, said, meant, is_stated, raw.path, raw.columns[key])
        if meant is not None:
            confirmed = said.sure
            break
    return ColumnUnit(unit, _KEYS[key], is_stated, confirmed, accepted)


def meant_unit(said: SaidUnit, kinds: tuple[Kind, ...]) -> Unit | None:
    """The unit of these kinds that a log says of a column; None where it says none of them.

    One letter behind a name is a unit only where logs commonly write it so: x_m, but not pos_c.
    """
    text = said.text.strip()
    if len(text) == 1 and not any(text in _LETTERS.get(kind, "") for kind in kinds):
        return None
    return unit_of(text, kinds)


def contradicts(said: SaidUnit, unit: Unit, kinds: tuple[Kind, ...]) -> bool:
    """Whether what a log says of a column speaks against `unit`.

    Volts in a units row, or seconds in brackets, are sure to be a unit but none of an angle's.
    """
    meant = meant_unit(said, kinds)
    if meant is not None:
        return not meant.same(unit)
    if not said.sure or (len(said.text.strip()) == 1 and not said.in_row):
        return False
    return is_unit(said.text) if said.in_row else any_unit(said.text) is not None


def _refuse(
    key: str, unit: Unit, said: SaidUnit, other: Unit | None, stated: bool, path: Path, column: str
) -> None:
    name = _KEYS[key]
    quantity = _ACCEPTED.get(key, key)
    taken = f"{name} says {unit.text}" if stated else f"without {name} it is read in {unit.text}"
    accept = f'accept_units = ["{quantity}"] to [columns] if {unit.text} is right'
    if other is None:
        fix = f"name the right column, correct {name}, or add {accept}"
    elif stated:
        fix = f'set {name} = "{said.text}" if that is right, or add {accept}'
    else:
        fix = f'add {name} = "{said.text}" to [columns], or {name} = "{unit.text}" with {accept}'
    raise RunError.at(
        path,
        f"{said.where} says {said.text}, but {taken}",
        fix,
        column=column,
        key=f"columns.{name}",
    )


def ask_for(key: str, column: ColumnUnit, metadata: Metadata) -> str:
    """How to state a unit that the numbers speak against."""
    quantity, shown = _ACCEPTED.get(key, key), examples(metadata.kinds_of(key)[0])
    if column.stated and key == "reading":
        return (
            f"correct {column.key} (one such as {shown}), or add "
            f'accept_units = ["{quantity}"] to [columns] if it is right'
        )
    return (
        f'add {column.key} to [columns]: one such as {shown}; "{column.unit.text}" if that is right'
    )
