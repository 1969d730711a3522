"""A sensor as it is described here, and a board's wiring as its firmware keeps it."""

from dataclasses import dataclass

from muscle_bayes.bench.boards.messages import Role


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
