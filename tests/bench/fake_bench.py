"""Boards, meter, heater tubes and keyboard as small fakes on one virtual clock: no firmware.

The boards speak the protocol by its own frames; everything else about them is made up here.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import exp

from muscle_bayes.bench.boards.board import Board
from muscle_bayes.bench.boards.link import Devices, Link
from muscle_bayes.bench.boards.protocol import crc16, frame
from muscle_bayes.bench.boards.transport import TransportError
from muscle_bayes.bench.meters.meter import REQUEST, Meter, format_answer
from muscle_bayes.data import Fixture, MuscleElement, Potentiometer

RIG = {
    "fixture": Fixture(
        rotor_radius_a=0.03,
        anchor_x_a=0.03,
        anchor_y_a=0.115,
        disc_radius=0.0889,
        stops=(-1.2, 1.2),
    ),
    "potentiometer": Potentiometer(zero_reading=512.0, radians_per_count=0.0058),
    "element_a": MuscleElement(base_length=0.1),
}
STEP = 0.001
DEADMAN = 0.4


class FakeClock:
    """Time that passes in `sleep` alone, in steps of 1 ms."""

    def __init__(self) -> None:
        self.steps = 0
        self.listeners: list[Callable[[float], None]] = []
        self._now = 0.0

    def now(self) -> float:
        return self._now

    def sleep(self, seconds: float) -> None:
        self._now += seconds
        while (self.steps + 1) * STEP <= self._now + 1e-9:
            self.steps += 1
            for listener in list(self.listeners):
                listener(self.steps * STEP)


class FakeLine:
    """A transport whose cable can be pulled and whose bytes can be changed."""

    def __init__(self) -> None:
        self.pulled = False
        self.garble: Callable[[bytes], bytes] = lambda data: data
        self.out = b""

    def read(self, max_bytes: int) -> bytes:
        self._check()
        data, self.out = self.out[:max_bytes], self.out[max_bytes:]
        return self.garble(data)

    def write(self, data: bytes) -> None:
        self._check()
        self.received(data)

    def received(self, data: bytes) -> None:
        raise NotImplementedError

    def close(self) -> None:
        pass

    def _check(self) -> None:
        if self.pulled:
            raise TransportError("fake: the line is gone.")


class FakeBoard(FakeLine):
    """Answers the protocol's commands; dead-man as the firmware has it."""

    def __init__(self, role: str, counts: Callable[[], int] = lambda: 512) -> None:
        super().__init__()
        self.role, self.counts = role, counts
        self.boot, self.cause, self.faults = 7, 1, 0
        self.duties = (0, 0)
        self.temperatures: tuple[str, ...] = ()
        self.limits = (255, 900, 1100)
        self.tightest = self.limits
        self.tubes: tuple[int, ...] = (450, 480, 450, 480)
        self.wiring: tuple[int, ...] = (0, 0, 0, 0, 0, 3950, 1000)
        self.own_temperatures: tuple[object, ...] = ("-", "-")
        self.second: object = "-"
        self.load: object = "-"
        self.marked = False
        self.fan = 0
        self.silent = False
        self.rate = 1.0
        """board seconds per second"""
        self.offset = 0.0
        self.drop = 0
        """samples to swallow"""
        self._period = self._due = self._commanded = 0.0
        self._number = 0
        self._now = 0.0
        self._rest = b""

    def step(self, now: float) -> None:
        self._now = now
        if any(self.duties) and now - self._commanded > DEADMAN:
            self.duties, self.faults = (0, 0), self.faults | 1
            self.say("!FAULT", self.faults)
        if self._period and now >= self._due - 1e-9:
            self._due += self._period
            if self.drop:
                self.drop -= 1
            else:
                micros = round(1e6 * (self.rate * now + self.offset)) % 2**32
                more = (self.faults, self.second, self.load)
                self.say(f"={self._number}", micros, 8 * self.counts(), *self.duties, *more)
            self._number = (self._number + 1) % 65536

    def reset(self, cause: int = 2, faults: int = 0) -> None:
        self.boot, self.cause, self.faults = self.boot + 1, cause, faults
        self.duties, self._period, self._number, self.fan = (0, 0), 0.0, 0, 0
        self.limits = (255, 900, 1100)
        self.offset = -self.rate * self._now
        self.say("!BOOT", 3, 3, self.boot, self.cause, self.role)

    def say(self, *words: object) -> None:
        if not self.silent:
            self.out += frame(" ".join(map(str, words)))

    def received(self, data: bytes) -> None:
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            if line[-5:] == b"*%04X" % crc16(line[:-5]):
                self._obey(line[:-5].decode())
            else:
                self.say("!CRC", 1)

    def _obey(self, text: str) -> None:
        sequence, verb, *arguments = text[1:].split(" ")
        answer: tuple[object, ...] = ()
        if verb == "ID":
            answer = (3, 3, self.boot, self.cause, self.role)
        elif verb == "DUTY":
            self._commanded = self._now
            wanted = (int(arguments[0]), int(arguments[1]))
            self.duties = (0, 0) if self.faults else wanted
            self.temperatures = tuple(arguments[2:])
            answer = (*self.duties, self.faults)
        elif verb == "STREAM":
            self._period, self._due = int(arguments[0]) / 1000, self._now
            answer = (arguments[0],)
        elif verb == "LIMIT":
            wanted = map(int, arguments)
            self.limits = tuple(min(pair) for pair in zip(wanted, self.tightest, strict=True))
            answer = self.limits
        elif verb == "CLEAR":
            self.faults = 0
            answer = (0,)
        elif verb == "FAN":
            self.fan = int(arguments[0])
            answer = (self.fan,)
        elif verb == "INPUTS":
            answer = self.wiring
        elif verb == "INPUT":
            answer = self.wiring = tuple(map(int, arguments))
        elif verb == "TEMPS":
            answer = self.own_temperatures
        elif verb == "ENCODER":
            self.marked = self.marked or arguments[0] == "1"
            answer = (int(self.marked),)
        elif verb == "TUBES":
            answer = self.tubes
        elif verb == "TUBE":
            channel, *tube = map(int, arguments)
            self.tubes = (*self.tubes[: 2 * channel], *tube, *self.tubes[2 * channel + 2 :])
            answer = tuple(tube)
        elif verb == "OFF":
            self.duties = (0, 0)
        self.say(f"<{sequence}", "OK", *answer)


class FakeMeter(FakeLine):
    """Answers 50 ms after a request, with a new reading every 0.4 s."""

    def __init__(self, temperatures: Callable[[], tuple[float, float]]) -> None:
        super().__init__()
        self.silent = self.frozen = False
        self.shown: list[float | None] = [None, None]
        self.forced: tuple[float | None, ...] | None = None
        self._temperatures = temperatures
        self._reading: tuple[float | None, ...] = temperatures()
        self._next = 0.0
        self._now = 0.0
        self._answers: list[float] = []

    def step(self, now: float) -> None:
        self._now = now
        if now >= self._next and not self.frozen:
            self._next += 0.4
            self._reading = self._temperatures()
        if self._answers and now >= self._answers[0]:
            self._answers.pop(0)
            if not self.silent:
                self.out += format_answer(self.forced or self._reading)

    def received(self, data: bytes) -> None:
        assert data == REQUEST
        self._answers.append(self._now + 0.05)


class FakeOperator:
    """Presses a key some time after it is asked; `stop_at` presses q."""

    def __init__(self, clock: FakeClock, delay: float = 0.3) -> None:
        self.clock, self.delay = clock, delay
        self.asked: list[float] = []
        self.stop_at = float("inf")
        self._due: float | None = None

    def ask(self, load: float, pour_time: float) -> None:
        self.asked.append(load)
        self._due = self.clock.now() + self.delay

    def poll(self) -> str | None:
        now = self.clock.now()
        if now >= self.stop_at:
            return "stop"
        if self._due is not None and now >= self._due:
            self._due = None
            return "go"
        return None


@dataclass
class FakeBench:
    """Two heater tubes that answer as the twin's do, a rotor that follows the first's warmth."""

    clock: FakeClock = field(default_factory=FakeClock)
    room: float = 25.0

    def __post_init__(self) -> None:
        self.tubes = [self.room, self.room]
        self.sensor = FakeBoard("SENSOR", lambda: round(400 + 2 * self.tubes[0]))
        self.heater = FakeBoard("HEATER")
        self.meter = FakeMeter(lambda: (round(self.tubes[0], 1), round(self.tubes[1], 1)))
        self.operator = FakeOperator(self.clock)
        self.clock.listeners += [self._heat, self.sensor.step, self.heater.step, self.meter.step]

    def _heat(self, now: float) -> None:
        decay = exp(-STEP / 48.0)
        for side, duty in enumerate(self.heater.duties):
            settled = self.room + 4.5 * 48.0 * duty / 255
            self.tubes[side] = settled + (self.tubes[side] - settled) * decay

    def board(self, line: FakeBoard, name: str) -> Board:
        board = Board(line, self.clock, name)
        board.identify(0.5)
        return board

    def devices(self) -> Devices:
        clock = self.clock
        return Devices(
            sensor=Link("sensor board", lambda: self.board(self.sensor, "sensor board"), clock),
            heater=Link("heater board", lambda: self.board(self.heater, "heater board"), clock),
            meter=Link("meter", lambda: Meter(self.meter, clock), clock),
            clock=clock,
        )

    def at(self, time: float, act: Callable[[], None]) -> None:
        """Do something once, at a time [s]."""
        done: list[bool] = []

        def listen(now: float) -> None:
            if now >= time and not done:
                done.append(True)
                act()

        self.clock.listeners.append(listen)
