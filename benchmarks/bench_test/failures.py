"""Injected failures: how long after each of them a heater is still on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from typing import Final

import numpy as np

from benchmarks.bench_test.host import HeatingHost
from muscle_bayes.bench.boards.messages import ResetCause
from muscle_bayes.bench.boards.protocol import encode
from muscle_bayes.bench.heat.temperature_control import PERIOD
from muscle_bayes.bench.sensors.catalogue import THERMOMETERS
from muscle_bayes.bench.simulation.bench import STEP, SimulatedBench
from muscle_bayes.bench.simulation.chips import BoardThermometers
from muscle_bayes.bench.simulation.processor import Processor

ALLOWED: Final = 0.5
"""Longest time that a heater may stay on after a failure has struck, s."""
AFTERMATH: Final = 2.0
"""Time after that in which no heater may come on again, s."""
LINE_RATE: Final = 11
"""Bytes that a noisy line delivers in 1 ms at 115200 baud."""

_LATEST: Final = 5.0
"""s by which there is heat in a sound bench."""

_PORTD, _TCCR0A, _TCCR0B, _OCR0A, _OCR0B = 0x2B, 0x44, 0x45, 0x47, 0x48
_RAM_START, _RAM_END = 0x100, 0x8FF
_HEATER_PINS = 0b0110_0000


@dataclass(frozen=True)
class Incident:
    """Where a failure strikes, and the random numbers of this one. A strike takes no time."""

    bench: SimulatedBench
    random: np.random.Generator


@dataclass(frozen=True)
class Failure:
    """One kind of failure."""

    name: str
    strike: Callable[[Incident], None]
    host_lives: bool
    """whether the host goes on afterwards; a board is alone where it does not"""


@dataclass(frozen=True)
class Outcome:
    """What followed one failure."""

    failure: str
    sensors: str
    """that the boards were wired to, besides potentiometer and meter"""
    seed: int
    heated: bool
    """whether a heater was on when it struck"""
    off_after: float
    """s from the moment it struck to the last at which a heater was on"""

    @property
    def safe(self) -> bool:
        return self.heated and self.off_after <= ALLOWED


def kill_host(at: Incident) -> None:
    """The host says nothing more."""


def stop_mid_command(at: Incident) -> None:
    """The host stops inside a heater command."""
    command = encode(int(at.random.integers(65536)), "DUTY", 255, 255, 400, 400)
    at.bench.heater_board.write(command[: at.random.integers(1, len(command) - 1)])


def repeat_other_commands(at: Incident) -> None:
    """The host hangs in a loop that asks for samples and heats no more."""
    numbers = at.random.integers(0, 65536, size=100)
    asked = [encode(int(n), "READ") for n in numbers]
    _every_millisecond(at.bench, lambda n: asked[n // 20 % 100] if n % 20 == 0 else b"")


def pull_cable(at: Incident) -> None:
    """The cable is pulled; the board keeps its power."""
    at.bench.heater_board.pull()
    at.bench.heater.drop_unsent()


def pull_and_plug(at: Incident) -> None:
    """The cable is pulled and plugged in again, which resets the board."""
    at.bench.heater_board.pull()
    _later(at.bench, int(at.random.integers(1, 300)), at.bench.heater_board.plug)


def noise(alphabet: bytes) -> Callable[[Incident], None]:
    """The line delivers these characters at random, at full rate."""
    letters = np.frombuffer(alphabet, np.uint8)

    def strike(at: Incident) -> None:
        _every_millisecond(at.bench, lambda _: at.random.choice(letters, LINE_RATE).tobytes())

    return strike


def noise_of_frames(at: Incident) -> None:
    """The line delivers heater commands whose checksum is wrong, and pieces of right ones."""
    right = encode(1, "DUTY", 255, 255, 400, 400)

    def piece(_: int) -> bytes:
        damaged = bytearray(right)
        damaged[at.random.integers(1, len(right) - 1)] ^= 1 << int(at.random.integers(7))
        cut = right[: at.random.integers(len(right) - 1)]
        return bytes(damaged) if at.random.random() < 0.5 else cut

    _every_millisecond(at.bench, lambda n: piece(n) if n % 4 == 0 else b"")


def garble_commands(at: Incident) -> None:
    """One bit of every command flips on the way to the board."""

    def garble(data: bytes) -> bytes:
        damaged = bytearray(data)
        damaged[at.random.integers(len(data))] ^= 1 << int(at.random.integers(8))
        return bytes(damaged)

    at.bench.heater_board.garble_to = garble


def echo(at: Incident) -> None:
    """The line returns to the board what the board says."""
    processor = at.bench.heater
    _every_millisecond(at.bench, lambda _: processor.receive())


def silence_meter(at: Incident) -> None:
    """The meter answers no more."""
    at.bench.thermometers.silent = True


def freeze_meter(at: Incident) -> None:
    """The meter repeats the same digits for ever."""
    at.bench.thermometers.frozen = True


def garble_thermometers(at: Incident) -> None:
    """The meter's answers, or the words of the board's own thermometers, are random."""
    if isinstance(at.bench.thermometers, BoardThermometers):
        at.bench.thermometers.garbled = True
    else:
        at.bench.meter.garble_from = lambda data: at.random.bytes(len(data))


def pull_thermometers(at: Incident) -> None:
    """The line of the thermometers is pulled."""
    if at.bench.own_thermometers:
        at.bench.thermometers.silent = True
    else:
        at.bench.meter.pull()


def open_thermocouple(at: Incident) -> None:
    """A thermocouple comes loose: OL."""
    channel = int(at.random.integers(2))
    at.bench.thermometers.open_channels = (channel == 0, channel == 1)


def force_temperature(low: float, high: float) -> Callable[[Incident], None]:
    """The meter shows a temperature [C] that cannot be."""

    def strike(at: Incident) -> None:
        shown = round(float(at.random.uniform(low, high)), 1)
        first = at.random.random() < 0.5
        at.bench.thermometers.forced = (shown, None) if first else (None, shown)

    return strike


def hang(interrupts: bool) -> Callable[[Incident], None]:
    """The firmware runs in an endless loop."""
    return lambda at: at.bench.heater.hang(interrupts=interrupts)


def reset(cause: ResetCause) -> Callable[[Incident], None]:
    """The board is reset while it heats."""
    return lambda at: at.bench.heater.reset(cause)


def jump(at: Incident) -> None:
    """The processor goes on at any place of the program, and the host is dead."""
    processor = at.bench.heater
    processor.jump(int(at.random.integers(processor.program_size)))


def hit_memory(at: Incident) -> None:
    """Sixteen bytes of RAM change, and the host is dead."""
    for _ in range(16):
        address = int(at.random.integers(_RAM_START, _RAM_END + 1))
        at.bench.heater.poke(address, int(at.random.integers(256)))


def hit_registers(at: Incident) -> None:
    """The heaters' output registers change behind the firmware's back."""
    processor: Processor = at.bench.heater
    for address in (_OCR0A, _OCR0B):
        processor.poke(address, int(at.random.integers(1, 256)))
    if at.random.random() < 0.5:
        processor.poke(_TCCR0B, 0)
    else:
        processor.poke(_TCCR0A, 0)
        processor.poke(_PORTD, processor.peek(_PORTD) | _HEATER_PINS)


def stop_then_hang(at: Incident) -> None:
    """The host dies, and just before its silence is noticed the firmware hangs."""
    interrupts = bool(at.random.integers(2))
    when = int(at.random.integers(300, 366))
    _later(at.bench, when, lambda: at.bench.heater.hang(interrupts=interrupts))


FAILURES: Final[tuple[Failure, ...]] = (
    Failure("host killed", kill_host, False),
    Failure("host stopped inside a command", stop_mid_command, False),
    Failure("host asks on, heats no more", repeat_other_commands, False),
    Failure("cable pulled", pull_cable, True),
    Failure("cable pulled and plugged in", pull_and_plug, True),
    Failure("noise: any bytes", noise(bytes(range(256))), False),
    Failure("noise: text", noise(b"DUTYREADOFFCLEAR>*0123456789ABCDEF \n"), False),
    Failure("noise: digits", noise(b"0123456789\n"), False),
    Failure("noise: the old protocol's own characters", noise(b"3652\n"), False),
    Failure("noise: breaks", noise(b"\x00\xff"), False),
    Failure("noise: damaged and cut heater commands", noise_of_frames, False),
    Failure("noise: a bit of each command", garble_commands, True),
    Failure("noise: the board hears itself", echo, False),
    Failure("meter silent", silence_meter, True),
    Failure("meter stuck", freeze_meter, True),
    Failure("meter gives random answers", garble_thermometers, True),
    Failure("meter pulled", pull_thermometers, True),
    Failure("meter disconnected (OL)", open_thermocouple, True),
    Failure("meter absurd: far too hot", force_temperature(251.0, 1300.0), True),
    Failure("meter absurd: too hot", force_temperature(130.0, 250.0), True),
    Failure("firmware hung, interrupts on", hang(interrupts=True), True),
    Failure("firmware hung, interrupts off", hang(interrupts=False), True),
    Failure("firmware at a random place", jump, False),
    Failure("firmware's memory hit", hit_memory, False),
    Failure("output registers hit", hit_registers, True),
    Failure("host dead, then firmware hung", stop_then_hang, False),
    Failure("brown-out reset", reset(ResetCause.BROWN_OUT), True),
    Failure("power-on reset", reset(ResetCause.POWER_ON), True),
    Failure("external reset", reset(ResetCause.EXTERNAL), True),
)


BENCHES: Final[tuple[tuple[str, ...], ...]] = ((), *((name,) for name in THERMOMETERS))
"""Sensors of the benches on which failures strike by turns: a meter, and each thermometer of the board."""


def inject(failure: Failure, seed: int, sensors: Sequence[str] = ()) -> Outcome:
    """Heat with random setpoints for a random time, let the failure strike, and watch the pins.

    `sensors` are what the boards are wired to besides potentiometer and meter.
    """
    random = np.random.default_rng([seed, *failure.name.encode()])
    setpoints = tuple(float(s) for s in random.uniform(80.0, 95.0, size=2))
    with SimulatedBench(seed=seed, sensors=sensors) as bench:
        host = HeatingHost(bench, (setpoints[0], setpoints[1]))
        host.run(float(random.uniform(0.3, 3.0)))
        bench.clock.sleep(float(random.uniform(0.0, 0.03)))
        while not any(bench.heater.duties) and bench.clock.now() < _LATEST:
            host.run(PERIOD)  # heat waits for the meter now and then
        heated = any(bench.heater.duties)
        bench.heater.peaks()
        last_on = -inf

        def watch(milliseconds: int) -> None:
            nonlocal last_on
            if any(bench.heater.peaks()):
                last_on = milliseconds * STEP

        bench.listeners.append(watch)
        struck = bench.clock.now()
        failure.strike(Incident(bench, random))
        rest = ALLOWED + AFTERMATH
        if failure.host_lives:
            host.run(rest)
        else:
            bench.clock.sleep(rest)
        return Outcome(failure.name, ", ".join(sensors), seed, heated, max(last_on - struck, 0.0))


def inject_all(
    count: int,
    seed: int = 0,
    progress: Callable[[float], None] = lambda share: None,
    failures: Sequence[Failure] = FAILURES,
) -> list[Outcome]:
    """At least that many failures, every kind as often as the next."""
    rounds = -(-count // len(failures))
    planned = [(failure, n) for n in range(rounds) for failure in failures]
    outcomes = []
    for number, (failure, n) in enumerate(planned):
        outcomes.append(inject(failure, seed + n, BENCHES[n % len(BENCHES)]))
        progress((number + 1) / len(planned))
    return outcomes


def _later(bench: SimulatedBench, milliseconds: int, act: Callable[[], None]) -> None:
    """Have something happen after that time."""
    due = round(bench.clock.now() / STEP) + milliseconds
    bench.listeners.append(lambda now: act() if now == due else None)


def _every_millisecond(bench: SimulatedBench, bytes_at: Callable[[int], bytes]) -> None:
    """Have the heater board receive these bytes from now on, whatever the host does."""
    bench.listeners.append(lambda n: bench.heater.send(bytes_at(n)))
