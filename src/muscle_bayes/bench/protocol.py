"""The boards' line protocol, version 1: bytes to messages and back, as pure functions.

A frame is `<start><body>*HHHH` and LF, at most 80 characters before the LF; HHHH is the
CRC-16/CCITT-FALSE of start and body. `MESSAGES` describes every frame: the encoder and the decoder
work from it, and so does the table in docs/protocol.md.
"""

from dataclasses import dataclass
from enum import IntFlag, StrEnum
from typing import Final, Literal

from muscle_bayes.errors import MuscleBayesError

VERSION: Final = 1
FRAME_MAX: Final = 80
"""Longest frame, without its LF."""
NO_READING: Final = "-"
"""Stands for the temperature of a channel without thermocouple."""

_CHECK_LENGTH = 5


class ProtocolError(MuscleBayesError):
    """A command that the protocol does not know, or whose arguments it cannot carry."""


class Fault(IntFlag):
    """Latched faults; any of them keeps the heaters off until CLEAR."""

    DEADMAN = 1
    OVER_TEMPERATURE = 2
    ON_TIME = 4
    WATCHDOG = 8
    BROWN_OUT = 16
    SENSOR = 32
    INTERNAL = 64


FAULT_MEANINGS: Final = {
    Fault.DEADMAN: "no valid heater command for 0.4 s while a heater was on",
    Fault.OVER_TEMPERATURE: "a reported temperature was above the limit",
    Fault.ON_TIME: "a channel was above half power for too long",
    Fault.WATCHDOG: "the firmware hung and was reset",
    Fault.BROWN_OUT: "the supply sagged and the board was reset",
    Fault.SENSOR: "a temperature was absent while heating, absurd, or stuck at high power",
    Fault.INTERNAL: "the board found its output registers wrong",
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
                f"{self.name} is {value}. Mend: {self.low} to {self.high} ({self.meaning})."
            )
        return str(int(value))


_U16 = 0xFFFF
_U32 = 0xFFFFFFFF
SEQUENCE: Final = Field("SEQ", "number of the command, chosen by the host and repeated in the reply", 0, _U16)
_VERSION = Field("VERSION", "of the protocol", 1, _U16)
_FIRMWARE = Field("FIRMWARE", "version of the firmware", 1, _U16)
_BOOT = Field("BOOT", "number of this boot, kept in EEPROM, wraps", 0, _U16)
_CAUSE = Field("CAUSE", "of the reset: 1 power-on, 2 external, 4 brown-out, 8 watchdog", 0, 15)
_ROLE = Field("ROLE", "what the board is wired for", words=tuple(Role))
_D0 = Field("D0", "duty of heater A, of 255", 0, 255)
_D1 = Field("D1", "duty of heater B, of 255", 0, 255)
_T0 = Field("T0", "temperature of channel A, 0.1 C, `-` = no thermocouple", -32767, 32767, (), True)
_T1 = Field("T1", "temperature of channel B, 0.1 C, `-` = no thermocouple", -32767, 32767, (), True)
_FAULTS = Field("FAULTS", "latched faults, sum of the bits below", 0, 255)
_PERIOD = Field("PERIOD_MS", "between samples, 5 to 10000, 0 = no stream", 0, 10000)
_NUMBER = Field("N", "number of the sample, wraps", 0, _U16)
_MICROS = Field("MICROS", "board's clock at the sample, us, wraps", 0, _U32)
_ADC = Field("ADC", "analog input 0", 0, 1023)
_SETPOINT = Field("SETPOINT", "analog input 0 that is wanted", 0, 1023)
_MAX_DUTY = Field("MAXDUTY", "highest duty", 0, 255)
_MAX_ON = Field("MAXON_MS", "time above half power, less the time below it, ms", 0, _U16)
_MAX_T = Field("MAXT", "highest reported temperature, 0.1 C", 0, 32767)
_COUNT = Field("COUNT", "garbled frames since the boot, wraps", 0, _U16)
_SAMPLE = (_MICROS, _ADC, _D0, _D1, _FAULTS)
_IDENTITY = (_VERSION, _FIRMWARE, _BOOT, _CAUSE, _ROLE)

ERRORS: Final = {
    "SEQ": "the sequence number is none",
    "VERB": "the verb is unknown",
    "ARGS": "arguments are missing, too many, or no numbers",
    "RANGE": "an argument is out of range",
    "ROLE": "heat was asked of a sensor board",
    "FAULT": "CLEAR was refused: the cause of a fault lasts",
    "GAINS": "HOLD was refused: no gains are compiled in",
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
        raise ProtocolError(f"{verb!r} is no command. Mend: one of {known}.")


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
        Command("READ", "send one sample, at most 1 ms old", (), _SAMPLE),
        Command(
            "LIMIT",
            "tighten limits until the next boot; looser values change nothing; "
            "tells those in force",
            (_MAX_DUTY, _MAX_ON, _MAX_T),
            (_MAX_DUTY, _MAX_ON, _MAX_T),
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
    ),
    notices=(
        Notice("=", "", "a streamed sample", (_NUMBER, *_SAMPLE)),
        Notice("!", "BOOT", "the board has come up, heaters off", _IDENTITY),
        Notice("!", "FAULT", "the latched faults have changed", (_FAULTS,)),
        Notice("!", "CRC", "a frame came garbled and was not acted on", (_COUNT,)),
    ),
)


@dataclass(frozen=True)
class Sample:
    """A streamed sample."""

    number: int
    micros: int
    adc: int
    duties: tuple[int, int]
    faults: Fault


@dataclass(frozen=True)
class Reply:
    """A board's OK; `read_answer` gives its fields their meaning."""

    sequence: int
    words: tuple[str, ...]


@dataclass(frozen=True)
class Error:
    """A board's refusal; `code` is a key of ERRORS."""

    sequence: int
    code: str


@dataclass(frozen=True)
class Identity:
    """Who is there: the answer to ID, and what a board tells when it boots."""

    protocol: int
    firmware: int
    boot: int
    cause: ResetCause
    role: Role


@dataclass(frozen=True)
class Boot:
    """A board has come up: whatever it was told before is forgotten."""

    identity: Identity


@dataclass(frozen=True)
class FaultReport:
    """The latched faults have changed."""

    faults: Fault


@dataclass(frozen=True)
class ChecksumReport:
    """The board received a garbled frame; `count` is the number of them since it booted."""

    count: int


@dataclass(frozen=True)
class Prompt:
    """The `w` of the old protocol."""


@dataclass(frozen=True)
class Garbled:
    """A line that is no frame."""

    line: bytes


Message = Sample | Reply | Error | Boot | FaultReport | ChecksumReport | Prompt | Garbled


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE: polynomial 0x1021, initial value 0xFFFF; crc16(b"123456789") = 0x29B1."""
    crc = 0xFFFF
    for byte in data:
        crc = ((crc >> 8) | (crc << 8)) & 0xFFFF
        crc ^= byte
        crc ^= (crc & 0xFF) >> 4
        crc ^= (crc << 12) & 0xFFFF
        crc ^= (crc & 0xFF) << 5
    return crc


def frame(text: str) -> bytes:
    """A frame around start and body."""
    data = text.encode("ascii")
    return data + b"*%04X\n" % crc16(data)


def encode(sequence: int, verb: str, *arguments: int | None) -> bytes:
    """A command's frame. Raises ProtocolError where the board would not understand it."""
    command = MESSAGES.command(verb)
    if len(arguments) != len(command.arguments):
        names = " ".join(field.name for field in command.arguments) or "nothing"
        raise ProtocolError(f"{verb} got {len(arguments)} arguments. Mend: it takes {names}.")
    words = [SEQUENCE.write(sequence), verb]
    words += [field.write(value) for field, value in zip(command.arguments, arguments, strict=True)]
    return frame(">" + " ".join(words))


def read_answer(verb: str, reply: Reply) -> tuple[int | str | None, ...]:
    """Values behind a command's OK, in the order of the table. Raises ProtocolError."""
    try:
        return _values(MESSAGES.command(verb).answer, reply.words)
    except ValueError as error:
        raise ProtocolError(
            f"the board's answer to {verb} is {' '.join(reply.words)!r}: {error}. "
            f"Mend: load the firmware of this version (protocol {VERSION})."
        ) from None


def identity(values: tuple[int | str | None, ...]) -> Identity:
    """Identity of the values that ID answers and BOOT tells."""
    *numbers, role = values
    protocol, firmware, boot, cause = (int(number or 0) for number in numbers)
    return Identity(protocol, firmware, boot, ResetCause(cause), Role(str(role)))


def decode_line(line: bytes) -> Message:
    """Message of one line, without its LF."""
    if line.strip() == b"w":
        return Prompt()
    text = line.removesuffix(b"\r")
    body, check = text[:-_CHECK_LENGTH], text[-_CHECK_LENGTH:]
    if len(text) > FRAME_MAX or check != b"*%04X" % crc16(body):
        return Garbled(line)
    try:
        return _message(body.decode("ascii"))
    except ValueError:
        return Garbled(line)


class Decoder:
    """Lines out of bytes as they come; what is longer than a frame is given up as garbled."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[Message]:
        """Messages that these bytes complete."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        messages = [decode_line(line) for line in lines if line.strip()]
        if len(self._rest) > 2 * FRAME_MAX:
            messages.append(Garbled(self._rest))
            self._rest = b""
        return messages


def _message(text: str) -> Message:
    start, words = text[:1], text[1:].split(" ")
    if start == "<" and len(words) >= 2:
        sequence = SEQUENCE.read(words[0])
        assert isinstance(sequence, int)
        if words[1] == "OK":
            return Reply(sequence, tuple(words[2:]))
        if words[1] == "ERR" and len(words) == 3 and words[2] in ERRORS:
            return Error(sequence, words[2])
    for notice in MESSAGES.notices:
        if notice.start == start and (not notice.word or notice.word == words[0]):
            return _notice(notice, words[1:] if notice.word else words)
    raise ValueError(text)


def _notice(notice: Notice, words: list[str]) -> Message:
    values = _values(notice.fields, words)
    if notice.word == "BOOT":
        return Boot(identity(values))
    numbers = [value for value in values if isinstance(value, int)]
    if notice.word == "FAULT":
        return FaultReport(Fault(numbers[0]))
    if notice.word == "CRC":
        return ChecksumReport(numbers[0])
    number, micros, adc, first, second, faults = numbers
    return Sample(number, micros, adc, (first, second), Fault(faults))


def _values(
    fields: tuple[Field, ...], words: list[str] | tuple[str, ...]
) -> tuple[int | str | None, ...]:
    if len(words) != len(fields):
        raise ValueError(f"{len(words)} fields, not {len(fields)}")
    return tuple(field.read(word) for field, word in zip(fields, words, strict=True))
