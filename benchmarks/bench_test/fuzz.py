"""Random command streams: whatever a line delivers, only what was asked is heated, and not for long."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from muscle_bayes.bench.boards.messages import MESSAGES, Field, ResetCause
from muscle_bayes.bench.boards.protocol import (
    Decoder,
    Garbled,
    Message,
    Reply,
    encode,
    frame,
    identity,
    read_answer,
)
from muscle_bayes.bench.simulation.bench import STEP
from muscle_bayes.bench.simulation.processor import Processor
from muscle_bayes.errors import MuscleBayesError

LONGEST_HEAT: Final = 0.5
"""s for which a heater may stay on after the last valid command."""
_LETTERS = b"DUTYSREAMOFCLIBX 0123456789-*>\r\n"
_OUT_OF_RANGE = 3
_VERBS = ("DUTY", "CLEAR", "READ", "ID", "OFF", "STREAM", "HOLD", "LIMIT")
_SHARES = (0.6, 0.2, 0.05, 0.05, 0.05, 0.02, 0.02, 0.01)
_RESET_EVERY = 20_000
"""bytes"""
_ACTING, _BOOTING = 3, 30
"""ms within which a command is in force, and after which a board is up"""
_PAUSES = 0.03


@dataclass(frozen=True)
class FuzzReport:
    """What a stream of random commands did."""

    sent: int
    """bytes"""
    commands: int
    """valid heater commands among them"""
    answered: int
    heats: int
    """those that asked for heat"""
    heated: int
    """ms during which a heater was on"""
    longest_heat: float
    """s from a valid heater command to the last ms at which its heat was still on"""
    wrong_heat: int
    """ms at which a heater had more than the last valid command asked for"""
    restarts: int
    """boots that nobody asked for"""
    garbled_answers: int


class _Ledger:
    """What the board was validly asked, and what its pins did."""

    def __init__(self) -> None:
        self.asked = (0, 0)
        self.on_the_way: tuple[int, int] | None = None
        self.since = 0
        self.heated = self.wrong = self.longest = 0

    def see(self, now: int, duties: tuple[int, int]) -> None:
        """Compare the pins' highest duties of a millisecond with what was asked by then."""
        allowed = [max(pair) for pair in zip(self.asked, self.on_the_way or (0, 0), strict=True)]
        self.heated += any(duties)
        if any(duties) and not any(self.on_the_way or ()):
            self.longest = max(self.longest, now - self.since)
        self.wrong += duties[0] > allowed[0] or duties[1] > allowed[1]

    def arrived(self, now: int) -> None:
        """The command on the way is in force."""
        if self.on_the_way is not None:
            self.asked, self.since, self.on_the_way = self.on_the_way, now, None


class _Fuzzer:
    """A heater board, the random bytes for it, and the ledger."""

    def __init__(self, processor: Processor, seed: int) -> None:
        self.processor = processor
        self.random = np.random.default_rng(seed)
        self.ledger = _Ledger()
        self.decoder = Decoder()
        self.heard: deque[Message] = deque(maxlen=16)
        self.now = self.sent = 0
        self.commands = self.heats = self.answered = self.garbled = 0

    def pass_time(self, milliseconds: int) -> None:
        for _ in range(milliseconds):
            self.processor.run(1)
            self.now += 1
            self.ledger.see(self.now, self.processor.peaks())
            for message in self.decoder.feed(self.processor.receive()):
                self.heard.append(message)
                self.answered += isinstance(message, Reply)
                self.garbled += isinstance(message, Garbled)

    def send(self, data: bytes, duties: tuple[int, int] | None) -> None:
        """Send bytes that validly ask for these duties, and wait until the board has acted."""
        self.ledger.on_the_way = duties
        self.processor.send(data)
        self.sent += len(data)
        while self.processor.unsent:
            self.pass_time(1)
        self.pass_time(_ACTING)
        self.ledger.arrived(self.now - _ACTING)
        self.commands += duties is not None
        self.heats += duties is not None and any(duties)

    def boots_by_its_count(self) -> int:
        """How often the board has booted. Raises MuscleBayesError."""
        self.send(b"\n" + encode(0, "STREAM", 0), None)
        self.pass_time(100)
        self.send(encode(1, "ID"), None)
        self.pass_time(10)
        last = self.heard[-1] if self.heard else None
        if isinstance(last, Reply) and last.sequence == 1:
            return identity(read_answer("ID", last)).boot + 1  # the first is 0
        raise MuscleBayesError("the fuzzed board does not answer any more")

    def restart(self) -> None:
        """Reset the board: a tightened limit would keep it cold for the rest."""
        self.processor.reset(ResetCause.EXTERNAL)
        self.processor.peaks()
        self.ledger.asked = (0, 0)
        self.pass_time(_BOOTING)


def fuzz(
    count: int, seed: int = 0, progress: Callable[[float], None] = lambda share: None
) -> FuzzReport:
    """Send a heater board at least that many bytes of valid, wrong and damaged commands and noise.

    Raises MuscleBayesError where the board does not answer at the end.
    """
    with Processor(heater=True) as processor:
        fuzzer = _Fuzzer(processor, seed)
        random, resets = fuzzer.random, 0
        while fuzzer.sent < count:
            if fuzzer.sent >= resets * _RESET_EVERY:
                fuzzer.restart()
                resets += 1
            fuzzer.send(*_piece(random))
            if random.random() < _PAUSES:
                fuzzer.pass_time(int(random.integers(1, 800)))
            progress(min(fuzzer.sent / count, 1.0))
        fuzzer.pass_time(1000)
        boots = fuzzer.boots_by_its_count()
        ledger = fuzzer.ledger
        return FuzzReport(
            sent=fuzzer.sent,
            commands=fuzzer.commands,
            answered=fuzzer.answered,
            heats=fuzzer.heats,
            heated=ledger.heated,
            longest_heat=ledger.longest * STEP,
            wrong_heat=ledger.wrong,
            restarts=boots - resets,
            garbled_answers=fuzzer.garbled,
        )


def _piece(random: np.random.Generator) -> tuple[bytes, tuple[int, int] | None]:
    """Some bytes, and the duties that they validly ask for (None: none)."""
    kind = random.integers(6)
    if kind == 0:
        return random.integers(0, 256, random.integers(1, 60), np.uint8).tobytes(), None
    if kind == 1:
        letters = np.frombuffer(_LETTERS, np.uint8)
        return random.choice(letters, random.integers(1, 60)).tobytes(), None
    data, duties = _command(random)
    if kind == 2:
        damaged = bytearray(data)
        damaged[random.integers(len(data))] ^= 1 << int(random.integers(8))
        return bytes(damaged), None
    if kind == 3:
        return data[: random.integers(1, data.index(b"*"))], None
    return data, duties


def _command(random: np.random.Generator) -> tuple[bytes, tuple[int, int] | None]:
    """A frame with the right checksum; its arguments are good or not."""
    command = MESSAGES.command(str(random.choice(_VERBS, p=_SHARES)))
    words = [_word(field, random) for field in command.arguments]
    if random.random() < 0.05:
        words.append("1")
    sequence = random.integers(65536)
    data = frame(" ".join([f">{sequence}", command.verb, *words]))
    if command.verb == "OFF" and not words:
        return data, (0, 0)
    if command.verb != "DUTY" or len(words) != len(command.arguments):
        return data, None
    try:
        first, second, *_ = (
            field.read(word) for field, word in zip(command.arguments, words, strict=True)
        )
    except ValueError:
        return data, None
    return data, (int(first or 0), int(second or 0))


def _word(field: Field, random: np.random.Generator) -> str:
    chance = random.random()
    if field.optional:
        if chance < 0.99:
            return str(random.integers(200, 900))
        return "-" if chance < 0.995 else str(random.integers(-9999, 9999))
    if chance < 0.98:
        return str(random.integers(field.low, field.high + 1))
    return str(random.choice([field.high + _OUT_OF_RANGE, -1, 10**9, 10**12]))
