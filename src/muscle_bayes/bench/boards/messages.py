"""Every frame of the boards' line protocol, version 3, as one table.

The encoder and the decoder (`protocol`) work from it, and so do the tables of docs/protocol.md.
"""

from dataclasses import dataclass
from enum import IntFlag, StrEnum
from typing import Final, Literal

from muscle_bayes.errors import MuscleBayesError

VERSION: Final = 3
NO_READING: Final = "-"
"""Stands for the temperature of a channel without thermocouple."""


AVERAGED: Final = 8
"""Conversions whose sum a sample tells: a count is that many."""


class ProtocolError(MuscleBayesError):
    """A command that the protocol does not know, or whose arguments it cannot carry."""


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


FAULT_MEANINGS: Final = {
    Fault.DEADMAN: "no valid heater command for 0.4 s while a heater was on",
    Fault.OVER_TEMPERATURE: "a reported temperature was above the limit",
    Fault.HEAT: "by the heat model a tube may be too hot, whatever was reported",
    Fault.WATCHDOG: "the firmware hung and was reset",
    Fault.BROWN_OUT: "the supply sagged and the board was reset",
    Fault.SENSOR: "a temperature was absent while heating, absurd, or did not show the heat given",
    Fault.INTERNAL: "the board found its output registers wrong",
    Fault.ANGLE: "the angle's potentiometer was open, shorted or jumped while the board held an angle",
}


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
        """Word for a value. Raises ProtocolError."""
        if value is None and self.optional:
            return NO_READING
        if value is None or not self.low <= value <= self.high:
            raise ProtocolError(
                f"{self.name} is {value}. Fix: {self.low} to {self.high} ({self.meaning})."
            )
        return str(int(value))


_U16 = 0xFFFF
_U32 = 0xFFFFFFFF
SEQUENCE: Final = Field(
    "SEQ", "number of the command, chosen by the host and repeated in the reply", 0, _U16
)
_VERSION = Field("VERSION", "of the protocol", 1, _U16)
_FIRMWARE = Field("FIRMWARE", "version of the firmware", 1, _U16)
_BOOT = Field("BOOT", "number of this boot, kept in EEPROM, wraps", 0, _U16)
_CAUSE = Field("CAUSE", "of the reset: 1 power-on, 2 external, 4 brown-out, 8 watchdog", 0, 15)
_ROLE = Field("ROLE", "what the board is wired for", words=tuple(Role))
_D0 = Field("D0", "duty of heater A, of 255", 0, 255)
_D1 = Field("D1", "duty of heater B, of 255", 0, 255)
_T0 = Field("T0", "temperature of channel A, 0.1 C, `-` = none", -32767, 32767, (), True)
_T1 = Field("T1", "temperature of channel B, 0.1 C, `-` = none", -32767, 32767, (), True)
_FAULTS = Field("FAULTS", "latched faults, sum of the bits below", 0, 255)
_PERIOD = Field("PERIOD_MS", "between samples, 5 to 10000, 0 = no stream", 0, 10000)
_NUMBER = Field("N", "number of the sample, wraps", 0, _U16)
_MICROS = Field("MICROS", "board's clock in the middle of the conversions, us, wraps", 0, _U32)
_ANGLE = Field(
    "ANGLE",
    "sum of 8 readings, one a ms: conversions of analog input 0, or an encoder's counts from 32768",
    0,
    8 * _U16,
)
_SECOND = Field("SECOND", "sum of 8 conversions of A1, `-` = not wired", 0, 8 * 1023, (), True)
_LOAD = Field(
    "LOAD", "newest of the load cell, `-` = not wired or silent", -(2**23), 2**23 - 1, (), True
)
_TA = Field("TA", "thermometer of A: 0 host, 1 MAX31855, 2 MAX6675, 3 thermistor", 0, 3)
_TB = Field("TB", "thermometer of B, as of A", 0, 3)
_ANGLE_BY = Field("BY", "sensor of the angle: 0 potentiometer on A0, 1 encoder", 0, 1)
_HAS_SECOND = Field("SECOND_POT", "1 = a second potentiometer on A1", 0, 1)
_HAS_LOAD = Field("LOAD_CELL", "1 = an HX711", 0, 1)
_BETA = Field("BETA", "of the thermistors, K", 1000, 9999)
_RATIO = Field("RATIO", "of their series resistor to their resistance at 25 C, 0.001", 10, _U16)
_MARK = Field("MARK", "1 = the encoder's zero has been found, 0 = only tell", 0, 1)
_MARKED = Field("MARKED", "1 = the encoder's zero is known", 0, 1)
_WIRING = (_TA, _TB, _ANGLE_BY, _HAS_SECOND, _HAS_LOAD, _BETA, _RATIO)
_SETPOINT = Field("SETPOINT", "analog input 0 that is wanted", 0, 1023)
_MAX_DUTY = Field("MAXDUTY", "highest duty", 0, 255)
_MAX_RISE = Field("MAXRISE", "highest rise above the room by the heat model, 0.1 C", 0, 32767)
_MAX_T = Field("MAXT", "highest reported temperature, 0.1 C", 0, 32767)
_FAN = Field("FAN", "1 = the fan is on", 0, 1)
_CHANNEL = Field("CHANNEL", "0 = heater A, 1 = heater B", 0, 1)
_GAIN = Field("GAIN", "rate of a tube at full duty, 0.01 C/s", 100, 1000)
_COOLING = Field("COOLING", "time constant of a tube, 0.1 s", 100, 1000)
_TUBES = tuple(
    Field(f"{name}{channel}", f"{meaning} of tube {'AB'[channel]}{more}", 0, _U16)
    for channel in range(2)
    for name, meaning, more in (
        ("G", "rate at full duty", ", 0.01 C/s; 0 = not calibrated"),
        ("C", "time constant", ", 0.1 s"),
    )
)
_COUNT = Field("COUNT", "garbled frames since the boot, wraps", 0, _U16)
_SAMPLE = (_MICROS, _ANGLE, _D0, _D1, _FAULTS, _SECOND, _LOAD)
_IDENTITY = (_VERSION, _FIRMWARE, _BOOT, _CAUSE, _ROLE)

ERRORS: Final = {
    "SEQ": "the sequence number is none",
    "VERB": "the verb is unknown",
    "ARGS": "arguments are missing, too many, or no numbers",
    "RANGE": "an argument is out of range",
    "ROLE": "heat, a tube, the fan, an input or an encoder was asked of a board without it",
    "FAULT": "CLEAR was refused: the cause of a fault lasts",
    "HEAT": "refused while a heater is on",
    "GAINS": "HOLD was refused: no gains are compiled in",
    "ANGLE": "HOLD was refused: the potentiometer on A0 reads as if a wire were broken or shorted",
    "BUSY": "no sample has been taken yet; ask again",
}
"""Codes of an ERR reply."""


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
        """Raises ProtocolError where the verb is unknown."""
        for command in self.commands:
            if command.verb == verb:
                return command
        known = ", ".join(c.verb for c in self.commands)
        raise ProtocolError(f"{verb!r} is no command. Fix: one of {known}.")


MESSAGES: Final = Table(
    commands=(
        Command("ID", "tell who is there", (), _IDENTITY),
        Command(
            "DUTY",
            "heat; feeds the dead-man, so it is repeated at least every 0.4 s",
            (_D0, _D1, _T0, _T1),
            (_D0, _D1, _FAULTS),
        ),
        Command("STREAM", "send samples at a steady rate", (_PERIOD,), (_PERIOD,)),
        Command("READ", "send one sample, the newest conversion at most 1 ms old", (), _SAMPLE),
        Command(
            "LIMIT",
            "tighten limits until the next boot; looser values change nothing; "
            "tells those in force",
            (_MAX_DUTY, _MAX_RISE, _MAX_T),
            (_MAX_DUTY, _MAX_RISE, _MAX_T),
        ),
        Command("CLEAR", "clear latched faults; heaters stay off", (), (_FAULTS,)),
        Command("OFF", "heaters off"),
        Command(
            "HOLD",
            "let the board hold an angle by the gains compiled in; feeds the dead-man like DUTY; "
            "ended by DUTY, OFF or a fault",
            (_SETPOINT, _T0, _T1),
            (_D0, _D1, _FAULTS),
        ),
        Command(
            "TUBE",
            "calibrate a heater tube; kept in EEPROM",
            (_CHANNEL, _GAIN, _COOLING),
            (_GAIN, _COOLING),
        ),
        Command("FAN", "switch pin 7, a fan's; off after every reset", (_FAN,), (_FAN,)),
        Command(
            "INPUT",
            "choose what the inputs are wired to; kept in EEPROM; an encoder counts anew",
            _WIRING,
            _WIRING,
        ),
        Command("INPUTS", "tell what the inputs are wired to", (), _WIRING),
        Command(
            "ENCODER",
            "1: its zero has been found; tells whether the count has gone on since it was",
            (_MARK,),
            (_MARKED,),
        ),
        Command("TEMPS", "tell what the board's own thermometers show", (), (_T0, _T1)),
        Command("TUBES", "tell how the tubes are calibrated", (), _TUBES),
    ),
    notices=(
        Notice("=", "", "a streamed sample", (_NUMBER, *_SAMPLE)),
        Notice("!", "BOOT", "the board has come up, heaters off", _IDENTITY),
        Notice("!", "FAULT", "the latched faults have changed", (_FAULTS,)),
        Notice("!", "CRC", "a frame came garbled and was not acted on", (_COUNT,)),
    ),
)
