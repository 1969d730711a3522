"""The boards' line protocol, version 3: bytes to messages and back, as pure functions.

A frame is `<start><body>*HHHH` and LF, at most 80 characters before the LF; HHHH is the
CRC-16/CCITT-FALSE of start and body. `messages.MESSAGES` describes what stands in it.
"""

from binascii import crc_hqx
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from muscle_bayes.bench.boards.messages import (
    ERRORS,
    MESSAGES,
    SEQUENCE,
    VERSION,
    Fault,
    Field,
    Notice,
    ResetCause,
    Role,
)
from muscle_bayes.errors import MuscleBayesError

FRAME_MAX: Final = 80
"""Longest frame, without its LF."""
_CHECK_LENGTH = 5

Values = tuple[Any, ...]
"""Of a frame's fields: a number, None for one that is absent, or a word."""


@dataclass(frozen=True)
class Sample:
    """A streamed sample."""

    number: int
    micros: int
    angle: int
    """sum of AVERAGED readings"""
    duties: tuple[int, int]
    faults: Fault
    second: int | None = None
    """sum of AVERAGED conversions of a second potentiometer"""
    load: int | None = None
    """newest of a load cell, counts"""


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
    return crc_hqx(data, 0xFFFF)


def frame(text: str) -> bytes:
    """A frame around start and body."""
    data = text.encode("ascii")
    return data + b"*%04X\n" % crc16(data)


def encode(sequence: int, verb: str, *arguments: int | None) -> bytes:
    """A command's frame. Raises MuscleBayesError where the board would not understand it."""
    command = MESSAGES.command(verb)
    if len(arguments) != len(command.arguments):
        names = " ".join(field.name for field in command.arguments) or "nothing"
        raise MuscleBayesError(f"{verb} got {len(arguments)} arguments. Fix: it takes {names}.")
    words = [SEQUENCE.write(sequence), verb]
    words += [field.write(value) for field, value in zip(command.arguments, arguments, strict=True)]
    return frame(">" + " ".join(words))


def read_answer(verb: str, reply: Reply) -> Values:
    """Values behind a command's OK, in the order of the table. Raises MuscleBayesError."""
    try:
        return _values(MESSAGES.command(verb).answer, reply.words)
    except ValueError as error:
        raise MuscleBayesError(
            f"the board's answer to {verb} is {' '.join(reply.words)!r}: {error}. "
            f"Fix: load the firmware of this version (protocol {VERSION})."
        ) from None


def identity(values: Values) -> Identity:
    """Identity of the values that ID answers and BOOT tells."""
    protocol, firmware, boot, cause, role = values
    return Identity(protocol, firmware, boot, ResetCause(cause), Role(role))


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
    if notice.word == "FAULT":
        return FaultReport(Fault(values[0]))
    if notice.word == "CRC":
        return ChecksumReport(values[0])
    number, micros, angle, first, second, faults, other, load = values
    return Sample(number, micros, angle, (first, second), Fault(faults), other, load)


def _values(fields: tuple[Field, ...], words: Sequence[str]) -> Values:
    if len(words) != len(fields):
        raise ValueError(f"{len(words)} fields, not {len(fields)}")
    return tuple(field.read(word) for field, word in zip(fields, words, strict=True))
