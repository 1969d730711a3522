"""The sensors that the firmware knows, and a board's wiring as it keeps it."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

from muscle_bayes.bench.boards.messages import Role
from muscle_bayes.errors import MuscleBayesError


@dataclass(frozen=True)
class Wiring:
    """The fields of INPUT, in their order (`firmware/src/inputs.h`)."""

    thermometer_a: int = 0
    thermometer_b: int = 0
    angle: int = 0
    second: int = 0
    load: int = 0
    beta: int = 3950
    """of the thermistors, K"""
    ratio: int = 1000
    """of their series resistor to their resistance at 25 C, in thousandths"""


@dataclass(frozen=True)
class Sensor:
    """One kind of sensor."""

    name: str
    what: str
    role: Role
    """of the board that it is wired to"""
    pins: tuple[tuple[str, str], ...]
    """pin of the board, and what goes there"""
    field: str
    """of the wiring, which it sets; `thermometer` stands for both channels'"""
    kind: int
    """what it sets it to"""


SENSORS: Final = {
    name: Sensor(name, **one | {"role": Role(one["role"]), "pins": tuple(map(tuple, one["pins"]))})
    for name, one in tomllib.loads(
        Path(__file__).with_name("sensors.toml").read_text(encoding="utf-8")
    ).items()
}
"""By name."""

THERMOMETERS: Final = tuple(name for name, one in SENSORS.items() if one.field == "thermometer")


def wiring_of(names: Sequence[str], role: Role, *, beta: int = 3950, ratio: float = 1.0) -> Wiring:
    """Wiring of the board of a role with those sensors that belong to it.

    beta [K] and ratio (series resistor to resistance at 25 C) are the thermistors'.
    Raises MuscleBayesError.
    """
    wiring = Wiring(beta=beta, ratio=round(1000 * ratio))
    for name in names:
        if name not in SENSORS:
            raise MuscleBayesError(f"{name!r} is no sensor. Fix: one of {', '.join(SENSORS)}.")
        sensor = SENSORS[name]
        if sensor.role is not role:
            continue
        keys = (
            ("thermometer_a", "thermometer_b") if sensor.field == "thermometer" else (sensor.field,)
        )
        if any(getattr(wiring, key) for key in keys):
            raise MuscleBayesError(f"{name}: its place is taken. Fix: one of {', '.join(names)}.")
        changes: dict[str, Any] = dict.fromkeys(keys, sensor.kind)
        wiring = replace(wiring, **changes)
    return wiring


def names_of(wiring: Wiring) -> tuple[str, ...]:
    """The sensors of a wiring."""
    has = {field.name: getattr(wiring, field.name) for field in fields(wiring)}
    has["thermometer"] = max(wiring.thermometer_a, wiring.thermometer_b)
    return tuple(name for name, one in SENSORS.items() if has[one.field] == one.kind)


def thermometer_of(wiring: Wiring) -> str | None:
    """Name of the thermometers of a heater board, None where the host's meter measures.

    Raises MuscleBayesError where its channels have different ones.
    """
    if wiring.thermometer_a != wiring.thermometer_b:
        raise MuscleBayesError(
            "the heater board has thermometers of different kinds on its channels, or one on one channel "
            "alone; a mix, also with the host's meter, cannot be recorded. Fix: wire both alike and say "
            "`muscle-bayes sensors NAME`, or `muscle-bayes sensors --none` for the meter"
        )
    return next((name for name in names_of(wiring) if name in THERMOMETERS), None)
