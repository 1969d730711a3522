"""A board on a line: commands out, messages in, and the reply that belongs to each command."""

from collections import deque
from collections.abc import Callable
from dataclasses import astuple, dataclass
from math import isfinite
from typing import Final

from muscle_bayes.bench.boards.clock import Clock
from muscle_bayes.bench.boards.messages import ERRORS, Fault
from muscle_bayes.bench.boards.messages import VERSION as PROTOCOL_VERSION
from muscle_bayes.bench.boards.protocol import (
    Boot,
    Decoder,
    Error,
    FaultReport,
    Identity,
    Message,
    Prompt,
    Reply,
    Sample,
    Values,
    encode,
    identity,
    read_answer,
)
from muscle_bayes.bench.boards.transport import Transport, TransportError
from muscle_bayes.bench.heat.heat_model import TubeModel
from muscle_bayes.bench.sensors.catalogue import Wiring
from muscle_bayes.errors import MuscleBayesError

SILENCE_LIMIT: Final = 1.0
"""A board that owes an answer and says nothing for this long is lost, s."""
_RETRY: Final = 0.25
"""Wait for a reply before the command is sent again, s; every command may be repeated."""
_POLL: Final = 0.002
_READ_SIZE: Final = 4096
_TENTHS_LIMIT: Final = 32767


class BoardError(MuscleBayesError):
    """A board that is lost, refuses, or is no board of this bench."""


@dataclass(frozen=True)
class HeaterState:
    """What the heater board says that it does: the reply to DUTY and HOLD."""

    duties: tuple[int, int]
    faults: Fault


class Board:
    """One board. Nothing here waits except `identify` and `request`, and these on the clock given.

    `heat`, `faults` and `identity` hold what the board told last.
    """

    def __init__(self, transport: Transport, clock: Clock, name: str = "board") -> None:
        self.name = name
        self.heat: HeaterState | None = None
        self.faults = Fault(0)
        self.fan: bool | None = None
        """whether the fan is on, as the board said last"""
        self.identity: Identity | None = None
        self._temperatures: tuple[float | None, float | None] | None = None
        self._transport = transport
        self._clock = clock
        self._decoder = Decoder()
        self._sequence = 0
        self._asked: dict[int, str] = {}
        self._unread: deque[Message] = deque()
        self._owed_since: float | None = None
        self._prompted = False

    def identify(self, timeout: float = 3.0) -> Identity:
        """Ask who is there, until the boot loader has made way and the board answers.

        Raises BoardError where nothing answers, or no firmware of this protocol.
        """
        identified = identity(self.request("ID", timeout=timeout))
        if identified.protocol != PROTOCOL_VERSION:
            raise BoardError(
                f"{self.name}: it speaks protocol {identified.protocol}, this program "
                f"{PROTOCOL_VERSION}. Fix: load firmware and program of one version."
            )
        self.identity = identified
        return identified

    def request(self, verb: str, *arguments: int | None, timeout: float = 1.0) -> Values:
        """Send a command, wait for its answer and return its values; other messages wait for `poll`.

        Raises BoardError where the board refuses or does not answer.
        """
        end = self._clock.now() + timeout
        sent: set[int] = set()
        while True:
            sent.add(self._send(verb, *arguments))
            retry = min(self._clock.now() + _RETRY, end)
            while self._clock.now() < retry:
                answers: list[Message] = []
                for message in self._receive():
                    ours = isinstance(message, Reply | Error) and message.sequence in sent
                    (answers if ours else self._unread).append(message)
                if answers:  # all that came with it is kept
                    return self._value_of(verb, answers[0])
                self._clock.sleep(_POLL)
            if self._clock.now() >= end:
                raise self._no_answer(verb, timeout)

    def _value_of(self, verb: str, answer: Message) -> Values:
        if isinstance(answer, Error):
            raise BoardError(f"{self.name}: {verb}: {ERRORS[answer.code]}.")
        assert isinstance(answer, Reply)
        return read_answer(verb, answer)

    def command_duty(
        self, first: int, second: int, first_t: float | None, second_t: float | None
    ) -> None:
        """Set heater duties (0-255) and report both temperatures [C, None = no thermocouple].

        The reply comes with `poll`, into `heat`. To be repeated within 0.4 s: see DEADMAN.
        """
        self._send("DUTY", first, second, tenths(first_t), tenths(second_t))

    def command_hold(self, reading: int, first_t: float | None, second_t: float | None) -> None:
        """Have the board hold a reading of its potentiometer [counts]; else as `command_duty`."""
        self._send("HOLD", reading, tenths(first_t), tenths(second_t))

    def command_fan(self, on: bool) -> None:
        """Switch the fan. The reply comes with `poll`, into `fan`; to be repeated until it does."""
        self._send("FAN", int(on))

    def stream(self, period_ms: int) -> None:
        """Have samples sent every so many ms; 0 ends it. Waits for the answer."""
        self.request("STREAM", period_ms)

    def limit(self, duty: int, rise: float, temperature: float) -> tuple[int, float, float]:
        """Tighten highest duty, modelled rise [C] and reported temperature [C]; those in force."""
        in_force = self.request("LIMIT", duty, tenths(rise), tenths(temperature))
        return in_force[0], in_force[1] / 10, in_force[2] / 10

    def tubes(self) -> tuple[TubeModel | None, TubeModel | None]:
        """How the heater tubes are calibrated, None where one is not."""
        values = self.request("TUBES")
        first, second = (
            TubeModel(gain, cooling) if gain else None
            for gain, cooling in zip(values[::2], values[1::2], strict=True)
        )
        return first, second

    def calibrate_tube(self, channel: int, tube: TubeModel) -> None:
        """Store the calibration of tube 0 or 1 on the board. Raises BoardError."""
        self.request("TUBE", channel, tube.gain, tube.cooling)

    def wiring(self) -> Wiring:
        """What the inputs are wired to."""
        return Wiring(*self.request("INPUTS"))

    def wire(self, wiring: Wiring) -> None:
        """Store what the inputs are wired to. Raises BoardError where that is another board's."""
        self.request("INPUT", *astuple(wiring))

    def encoder_marked(self, *, mark: bool = False) -> bool:
        """Whether an encoder's count has gone on since its zero was found; `mark`: it is found now."""
        return bool(self.request("ENCODER", int(mark))[0])

    def ask_temperatures(self) -> None:
        """Ask what the board's own thermometers show; the reply is for `take_temperatures`."""
        self._send("TEMPS")

    def take_temperatures(self) -> tuple[float | None, float | None] | None:
        """What the board's own thermometers showed [C], once a reply; None where there is no new one."""
        shown, self._temperatures = self._temperatures, None
        return shown

    def clear(self) -> None:
        """Clear latched faults. Raises BoardError while the cause of one lasts."""
        self.request("CLEAR")
        self.faults = Fault(0)

    def off(self) -> None:
        """Heaters off. Does not wait."""
        self._send("OFF")

    def poll(self) -> list[Message]:
        """Messages that have come. Raises BoardError where the line is gone or the board silent."""
        messages = [*self._unread, *self._receive()]
        self._unread.clear()
        if self._owed_since is not None:
            silence = self._clock.now() - self._owed_since
            if silence > SILENCE_LIMIT:
                raise BoardError(
                    f"{self.name}: it owes an answer and has said nothing for {silence:.1f} s. "
                    "Fix: check cable and power."
                )
        return messages

    def collect(self) -> None:
        """Take in what has come, for `poll` to give. Raises BoardError where the line is gone."""
        self._unread.extend(self._receive())

    def close(self) -> None:
        """Release the line; never raises."""
        self._transport.close()

    def _send(self, verb: str, *arguments: int | None) -> int:
        sequence = self._sequence
        self._sequence = (sequence + 1) % 0x10000
        self._on_line(lambda: self._transport.write(encode(sequence, verb, *arguments)))
        if len(self._asked) > 64:  # replies that were lost on the way
            self._asked.pop(next(iter(self._asked)))
        self._asked[sequence] = verb
        if self._owed_since is None:
            self._owed_since = self._clock.now()
        return sequence

    def _receive(self) -> list[Message]:
        data = self._on_line(lambda: self._transport.read(_READ_SIZE))
        messages = self._decoder.feed(data)
        for message in messages:
            self._note(message)
        return messages

    def _note(self, message: Message) -> None:
        """Keep what the message says of the board's state."""
        if isinstance(message, Reply | Error):
            verb = self._asked.pop(message.sequence, None)
            self._owed_since = self._clock.now() if self._asked else None
            if isinstance(message, Reply) and verb in ("DUTY", "HOLD"):
                first, second, faults = read_answer(verb, message)
                self.heat = HeaterState((first, second), Fault(faults))
                self.faults = Fault(faults)
            elif isinstance(message, Reply) and verb == "TEMPS":
                first_t, second_t = (
                    None if value is None else value / 10 for value in read_answer(verb, message)
                )
                self._temperatures = (first_t, second_t)
            elif isinstance(message, Reply) and verb == "FAN":
                self.fan = bool(read_answer(verb, message)[0])
        elif isinstance(message, FaultReport | Sample):
            self.faults = message.faults
        elif isinstance(message, Boot):
            self.identity = message.identity
            self.heat = None
            self.fan = False  # every reset switches it off
            self._asked.clear()
            self._owed_since = None
        elif isinstance(message, Prompt):
            self._prompted = True

    def _on_line[T](self, act: Callable[[], T]) -> T:
        try:
            return act()
        except TransportError as error:
            raise BoardError(f"{self.name}: {error}") from None

    def _no_answer(self, verb: str, timeout: float) -> BoardError:
        if self._prompted and verb == "ID":
            return BoardError(
                f"{self.name}: only the old firmware answers there. Fix: load the firmware of "
                "this program, see docs/bench.md."
            )
        return BoardError(
            f"{self.name}: no answer to {verb} in {timeout:g} s. Fix: check that a board is on "
            "this port, that it has power and the firmware (docs/bench.md)."
        )


def tenths(temperature: float | None) -> int | None:
    """Tenths of a degree, what is beyond the range at its end; None for what is no number."""
    if temperature is None or not isfinite(temperature):
        return None
    return max(-_TENTHS_LIMIT, min(round(10 * temperature), _TENTHS_LIMIT))
