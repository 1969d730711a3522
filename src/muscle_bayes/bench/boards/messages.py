"""Every frame of the boards' line protocol, version 3, as one table, read from protocol.toml.

The encoder and the decoder (`protocol`) work from it, and so do the tables of docs/protocol.md.
"""

import tomllib
from dataclasses import dataclass
from enum import IntFlag, StrEnum
from pathlib import Path
from typing import Any, Final, Literal

from muscle_bayes.errors import MuscleBayesError

VERSION: Final = 3
NO_READING: Final = "-"
"""Stands for the temperature of a channel without thermocouple."""


AVERAGED: Final = 8
"""Conversions whose sum a sample tells: a count is that many."""


class Fault(IntFlag):
    """Latched faults; any of them keeps the heaters off until CLEAR."""

    DEADMAN = 1
    OVER_TEMPERATURE = 2
    HEAT = 4
    WATCHDOG = 8
    BROWN_OUT = 16
    SENSOR = 32
    INTERNAL = 64
    ANGLE = 128


def explain(faults: int) -> str:
    """Faults in words, e.g. for a message."""
    return "; ".join(text for fault, text in FAULT_MEANINGS.items() if faults & fault) or "none"


class ResetCause(IntFlag):
    """Why a board came up, as its MCUSR register tells; 0 where a boot loader has hidden it."""

    POWER_ON = 1
    EXTERNAL = 2
    BROWN_OUT = 4
    WATCHDOG = 8


class Role(StrEnum):
    """What a board is wired for: pin 4 tied to GND makes a heater board."""

    SENSOR = "SENSOR"
    HEATER = "HEATER"


@dataclass(frozen=True)
class Field:
    """One number of a frame, low <= value <= high, or one of some words."""

    name: str
    meaning: str
    low: int = 0
    high: int = 0
    words: tuple[str, ...] = ()
    optional: bool = False
    """`-` may stand in its place."""

    def read(self, text: str) -> int | str | None:
        """Value of a word. Raises ValueError."""
        if self.words:
            if text not in self.words:
                raise ValueError(f"{self.name} is {text!r}")
            return text
        if self.optional and text == NO_READING:
            return None
        digits = text[1:] if text.startswith("-") else text
        if not (digits.isascii() and digits.isdigit() and self.low <= int(text) <= self.high):
            raise ValueError(f"{self.name} is {text!r}, not {self.low} to {self.high}")
        return int(text)

    def write(self, value: int | None) -> str:
        """Word for a value. Raises MuscleBayesError."""
        if value is None and self.optional:
            return NO_READING
        if value is None or not self.low <= value <= self.high:
            raise MuscleBayesError(
                f"{self.name} is {value}. Fix: {self.low} to {self.high} ({self.meaning})."
            )
        return str(int(value))


@dataclass(frozen=True)
class Command:
    """What the host can ask, and what the board answers behind `OK`."""

    verb: str
    does: str
    arguments: tuple[Field, ...] = ()
    answer: tuple[Field, ...] = ()


@dataclass(frozen=True)
class Notice:
    """What a board sends unasked."""

    start: Literal["=", "!"]
    word: str
    does: str
    fields: tuple[Field, ...]


@dataclass(frozen=True)
class Table:
    """Every frame of the protocol."""

    commands: tuple[Command, ...]
    notices: tuple[Notice, ...]

    def command(self, verb: str) -> Command:
        """Raises MuscleBayesError where the verb is unknown."""
        for command in self.commands:
            if command.verb == verb:
                return command
        known = ", ".join(c.verb for c in self.commands)
        raise MuscleBayesError(f"{verb!r} is no command. Fix: one of {known}.")


_TOLD: Final = tomllib.loads(Path(__file__).with_name("protocol.toml").read_text(encoding="utf-8"))
FAULT_MEANINGS: Final = {Fault[name]: text for name, text in _TOLD["faults"].items()}
ERRORS: Final[dict[str, str]] = _TOLD["errors"]
"""Codes of an ERR reply."""
FIELDS: Final = {
    name: Field(name, **one | {"words": tuple(one.get("words", ()))})
    for name, one in _TOLD["fields"].items()
}
SEQUENCE: Final = FIELDS["SEQ"]


def _with_fields(told: dict[str, Any]) -> dict[str, Any]:
    """A command's or notice's table, names of fields replaced by these."""
    return {
        key: tuple(FIELDS[name] for name in value) if isinstance(value, list) else value
        for key, value in told.items()
    }


MESSAGES: Final = Table(
    commands=tuple(Command(**_with_fields(one)) for one in _TOLD["commands"]),
    notices=tuple(Notice(**_with_fields(one)) for one in _TOLD["notices"]),
)
