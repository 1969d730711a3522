"""The TMD-56 thermocouple meter: its bytes as pure functions, and its drivers."""

import struct
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Final, Protocol

from muscle_bayes.bench.boards.clock import Clock
from muscle_bayes.bench.boards.transport import Transport, TransportError, meter_transport
from muscle_bayes.errors import MuscleBayesError

REQUEST: Final = b"#0A0000NA2\r\n"
_ANSWER: Final = struct.Struct(">5xH3xH2x")
"""T1 and T2 among the bytes of an answer, unsigned big endian, tenths of a degree."""
ANSWER_LENGTH: Final = _ANSWER.size
OPEN_TENTHS: Final = 0xFFFF
"""What `format_answer` writes for an open channel (OL on the display)."""
RANGE_TENTHS: Final = 13720
"""End of a type K thermocouple's range: beyond it the meter shows OL."""

ANSWER_TIME: Final = 0.6
"""Longest wait for an answer before the next request, s."""
FASTEST: Final = 30.0
"""Change that no heater tube does, C/s."""
_UPDATE: Final = 0.5
"""Longest time between two measurements of the meter, s."""
NEW: Final = 1.0
"""Age up to which a reading says how warm it is now, s."""
_POLL: Final = 0.01
"""s between a thread's looks at its meter."""
PAUSE: Final = 0.05
"""s from something that was no answer to the next request, so that its rest can pass."""


class MeterError(MuscleBayesError):
    """A meter that does not answer, or whose line is gone."""


@dataclass(frozen=True)
class Reading:
    """Both channels at once."""

    time: float
    """host time of arrival, s"""
    temperatures: tuple[float | None, float | None]
    """T1 and T2, C; None where the channel is open (OL)"""
    asked: float | None = None
    """host time of the request, s; None where there was none"""


def raw_answer(answer: bytes) -> tuple[int, int]:
    """T1 and T2 of an answer as the meter codes them.

    Raises ValueError where the answer does not have 14 bytes.
    """
    if len(answer) != ANSWER_LENGTH:
        raise ValueError(f"an answer has {ANSWER_LENGTH} bytes, this one {len(answer)}")
    first, second = _ANSWER.unpack(answer)
    return first, second


def parse_answer(answer: bytes) -> tuple[float | None, float | None]:
    """T1 and T2 [C] of an answer, None where open (OL).

    Raises ValueError where the answer does not have 14 bytes.
    """
    first, second = (None if raw > RANGE_TENTHS else raw / 10 for raw in raw_answer(answer))
    return first, second


def agrees(before: int, raw: int, passed: float) -> bool:
    """Whether a channel's code can follow another after a time [s]: by warmth, or OL as before."""
    if before > RANGE_TENTHS or raw > RANGE_TENTHS:
        return before == raw
    return abs(raw - before) <= 10 * FASTEST * max(passed, _UPDATE)


def format_answer(temperatures: Sequence[float | None]) -> bytes:
    """The 14 bytes that the meter sends for T1 and T2 [C, None = open]; for emulations of it."""
    return _ANSWER.pack(*(OPEN_TENTHS if t is None else round(10 * t) for t in temperatures))


class MeterSource(Protocol):
    """Where the recorder takes its temperatures from."""

    @property
    def latest(self) -> Reading | None:
        """The newest reading. Raises MeterError where the line is gone."""

    @property
    def garbled(self) -> int:
        """Answers that were no answers, since the start."""

    @property
    def moved_within(self) -> float:
        """s of hard heating, pauses left out, after which its digits must have changed."""

    def poll(self) -> None:
        """Do what is due, without waiting."""

    def close(self) -> None:
        """Release the line; never raises."""


class Meter:
    """Polled by its owner: asks, collects the answer, asks again at once; never waits.

    It measures every 0.4 s or so. The age of a reading is the log's lag behind the truth, and heaters
    rise by some C a second.

    An answer carries neither start mark nor checksum, so what makes it one is that it comes alone
    (input is thrown away before each request, and bytes in excess void the answer) and that it agrees
    with the answer before it: no tube jumps. One that does not is counted as garbled and not used.
    """

    moved_within = 0.38

    def __init__(self, transport: Transport, clock: Clock) -> None:
        self._transport = transport
        self._clock = clock
        self._buffer = b""
        self._asked: float | None = None
        self._due = clock.now()
        self.latest: Reading | None = None
        self.garbled = 0
        self._before: tuple[float, tuple[int, int]] | None = None
        """time of the answer before [s], used or not, and its codes"""

    def poll(self) -> None:
        """Raises MeterError where the line is gone."""
        try:
            self._poll(self._clock.now())
        except TransportError as error:
            raise MeterError(f"meter: {error}") from None

    def close(self) -> None:
        self._transport.close()

    def _poll(self, now: float) -> None:
        received = self._transport.read(256)
        if self._asked is None:
            if now >= self._due:
                self._buffer = b""
                self._transport.write(REQUEST)
                self._asked = now
            return
        self._buffer += received
        if len(self._buffer) == ANSWER_LENGTH:
            if self._confirmed(now, raw_answer(self._buffer)):
                self.latest = Reading(now, parse_answer(self._buffer), self._asked)
            self._asked, self._due = None, now
            return
        if len(self._buffer) > ANSWER_LENGTH or now - self._asked > ANSWER_TIME:
            self.garbled += bool(self._buffer)
            self._asked, self._due = None, now + PAUSE

    def _confirmed(self, now: float, raws: tuple[int, int]) -> bool:
        """Whether an answer agrees with the one before; the first of all has none."""
        before, self._before = self._before, (now, raws)
        if before is None:
            return False
        time, codes = before
        sound = all(agrees(code, raw, now - time) for code, raw in zip(codes, raws, strict=True))
        self.garbled += not sound
        return sound


class ThreadedMeter:
    """A meter that a thread of its own polls in real time, so that its waits delay nobody."""

    def __init__(self, meter: MeterSource) -> None:
        self._meter = meter
        self.moved_within = meter.moved_within
        self._error: MuscleBayesError | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="meter", daemon=True)
        self._thread.start()

    @property
    def latest(self) -> Reading | None:
        return self._meter.latest

    @property
    def garbled(self) -> int:
        return self._meter.garbled

    def poll(self) -> None:
        """Raises MeterError where the thread met a line that is gone."""
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        self._stop.set()
        with suppress(RuntimeError):
            self._thread.join(1.0)
        self._meter.close()

    def _run(self) -> None:
        while not self._stop.wait(_POLL):
            try:
                self._meter.poll()
            except MuscleBayesError as error:
                self._error = error
                return


def first_reading(meter: MeterSource, clock: Clock, timeout: float) -> Reading:
    """Wait for a reading that is new. Raises MeterError where none comes."""
    end = clock.now() + timeout
    while (latest := meter.latest) is None or clock.now() - latest.time > NEW:
        if clock.now() > end:
            garbled = f", {meter.garbled} garbled answers" if meter.garbled else ""
            raise MeterError(
                f"the meter gave no reading in {timeout:g} s{garbled}. Fix: switch it on and its "
                "link (the display shows it), check the cable and --meter."
            )
        meter.poll()
        clock.sleep(0.01)
    return latest


GROUP: Final = "muscle_bayes.meters"
"""Entry points of installed packages that open a meter: `open(url, clock) -> MeterSource`."""
FIRST: Final = "tmd-56"

OpenMeter = Callable[[str, Clock], MeterSource]
"""Opens a meter on a URL, to be read by a host's clock. Raises MuscleBayesError."""


def open_tmd56(url: str, clock: Clock) -> MeterSource:
    """The TMD-56, polled by a thread of its own."""
    return ThreadedMeter(Meter(meter_transport(url), clock))


def kinds() -> dict[str, OpenMeter]:
    """Every kind by its name."""
    return {FIRST: open_tmd56, **{one.name: one.load() for one in entry_points(group=GROUP)}}


def split(meter: str) -> tuple[str, str]:
    """Kind and URL of what a user gives: `KIND:URL`, or the URL of a TMD-56.

    Raises MuscleBayesError where a kind is named without a URL.
    """
    known = kinds()
    kind, colon, url = meter.partition(":")
    if kind not in known:
        return FIRST, meter
    if not colon or not url:
        raise MuscleBayesError(f"--meter {meter}: no port. Fix: --meter {kind}:PORT.")
    return kind, url
