"""Sensors that lie and hosts that heat on: how hot a tube gets, whatever is shown.

The tubes and their heaters are the twin's, the firmware is the compiled one. In most trials a host
without any judgement heats by the firmware's own leave; in the others it is the recorder's host.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from benchmarks.bench_test import lies
from benchmarks.bench_test.host import HeatingHost
from benchmarks.bench_test.lies import Shown
from muscle_bayes.bench.boards.messages import ResetCause
from muscle_bayes.bench.boards.protocol import Decoder, Reply, encode, read_answer
from muscle_bayes.bench.sensors.catalogue import THERMOMETERS
from muscle_bayes.bench.simulation.bench import STEP, SimulatedBench
from muscle_bayes.bench.simulation.chips import BoardThermometers
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin.plant.heater import HeaterTube
from muscle_bayes.twin.plant.rig import Rig

HOTTEST: Final = 120.0
"""What no tube may exceed, C."""
WATCHED: Final = 150.0
"""s for which a trial heats."""
_FOR_GOOD: Final = 15.0
"""s without heat after which a board will give none any more."""
COMMAND_EVERY: Final = 0.1
"""s between commands of the host without judgement."""


class TubesOnly:
    """The twin's two heater tubes without a rotor: what these trials need of a plant."""

    def __init__(self, rig: Rig | None = None) -> None:
        self.rig = rig or Rig()
        heater, room = self.rig.heater, self.rig.fixture.room_temperature
        self.tubes = tuple(
            HeaterTube(heater.full_rate, heater.cooling_time, room) for _ in range(2)
        )

    def advance(self, duties: tuple[float, float], duration: float) -> None:
        for tube, duty in zip(self.tubes, duties, strict=True):
            tube.advance(duty, duration)

    angle, load = 0.0, 0.0

    def counts(self) -> int:
        return 512

    def counts_2(self) -> int:
        return 512

    def blow(self, on: bool) -> None:
        """No fan is there."""

    def temperatures(self) -> tuple[float, float]:
        first, second = self.tubes
        return first.temperature, second.temperature

    def hang(self, mass: float) -> None:
        """Nothing hangs here."""


@dataclass(frozen=True)
class Outcome:
    """What followed."""

    trial: str
    seed: int
    peak: float
    """highest temperature of a tube, C"""
    heated: float
    """s until the last moment at which a heater was on"""
    faults: int
    """latched at the end"""
    stopped: str
    """why the recorder's host has given up, if it has"""

    @property
    def safe(self) -> bool:
        return self.peak <= HOTTEST


@dataclass(frozen=True)
class Trial:
    """One way to overheat a tube."""

    name: str
    heat: Callable[[SimulatedBench, np.random.Generator, float], str]
    """heats for a time [s]; says why the host has stopped, if it has"""
    sensors: tuple[str, ...] = ()
    """that the boards are wired to, besides potentiometer and meter"""


def run(trial: Trial, seed: int = 0, watched: float = WATCHED) -> Outcome:
    """Try it on a calibrated board and watch both tubes."""
    random = np.random.default_rng([seed, *trial.name.encode()])
    plant = TubesOnly()
    with SimulatedBench(plant, seed, sensors=trial.sensors) as bench:
        peak, last_on = 0.0, 0.0

        def watch(milliseconds: int) -> None:
            nonlocal peak, last_on
            peak = max(peak, *plant.temperatures())
            if any(bench.heater.duties):
                last_on = milliseconds * STEP

        bench.listeners.append(watch)
        stopped = trial.heat(bench, random, watched)
        bench.clock.sleep(1.0)
        faults = _faults(bench)
        return Outcome(trial.name, seed, peak, last_on, faults, stopped)


def _faults(bench: SimulatedBench) -> int:
    """By the pins' own board: asked by a frame, in whatever protocol it was before."""
    decoder = Decoder()
    bench.heater_board.read(1 << 16)
    bench.heater_board.write(b"\n" + encode(7, "DUTY", 0, 0, None, None))
    bench.clock.sleep(0.2)
    for message in decoder.feed(bench.heater_board.read(1 << 16)):
        if isinstance(message, Reply) and message.sequence == 7:
            return int(read_answer("DUTY", message)[2] or 0)
    return 0


# A host that heats whatever it is told.


def _blind(
    duty: int, shown: Shown, pause_every: float = 0.0, pause: float = 0.0, clear: bool = False
) -> Callable[[SimulatedBench, np.random.Generator, float], str]:
    """Heats channel A with a duty, by framed commands that report what is shown."""

    def heat(bench: SimulatedBench, random: np.random.Generator, watched: float) -> str:
        off_for_good = _watch_for_the_end(bench)
        begun = bench.clock.now()
        own = bench.own_thermometers
        if own:
            bench.thermometers.shows = lambda time, true: shown(time - begun, true)
        bench.clock.sleep(0.5 if own else 0.05)
        number = 0
        while (now := bench.clock.now() - begun) < watched and not off_for_good():
            told = shown(now, bench.plant.temperatures())
            temperatures = [None if own else round(10 * t) for t in told]
            bench.heater_board.write(encode(number % 65536, "DUTY", duty, 0, *temperatures))
            if clear:
                bench.heater_board.write(encode((number + 1) % 65536, "CLEAR"))
            number += 2
            if pause_every and now % pause_every < COMMAND_EVERY:
                bench.clock.sleep(0.01)
                bench.heater_board.write(encode(number % 65536, "DUTY", 0, 0, *temperatures))
                bench.clock.sleep(pause)
            else:
                bench.clock.sleep(COMMAND_EVERY)
            bench.heater_board.read(1 << 16)
        return ""

    return heat


def _blind_with_resets(
    cause: ResetCause, between: tuple[float, float] = (2.0, 6.0)
) -> Callable[[SimulatedBench, np.random.Generator, float], str]:
    """As that, and the board is reset again and again [s], before it can notice."""
    part = _blind(255, lies.stuck)

    def heat(bench: SimulatedBench, random: np.random.Generator, watched: float) -> str:
        end = bench.clock.now() + watched
        while bench.clock.now() < end:
            part(bench, random, float(random.uniform(*between)))
            bench.heater.reset(cause)
            bench.clock.sleep(0.1)
        return ""

    return heat


def _old(duty: int) -> Callable[[SimulatedBench, np.random.Generator, float], str]:
    """An old script that sets channel A's PWM again and again."""

    def heat(bench: SimulatedBench, random: np.random.Generator, watched: float) -> str:
        end = bench.clock.now() + watched
        off_for_good = _watch_for_the_end(bench)
        _answer(bench, 99)
        while bench.clock.now() < end and not off_for_good():
            for number in (3, 6, duty):
                if not _answer(bench, number):
                    bench.clock.sleep(0.1)
        return ""

    return heat


def _watch_for_the_end(bench: SimulatedBench) -> Callable[[], bool]:
    """Whether the heaters have been off for so long that the board will not heat again."""
    last_on = bench.clock.now()

    def off_for_good() -> bool:
        nonlocal last_on
        if any(bench.heater.duties):
            last_on = bench.clock.now()
        return bench.clock.now() - last_on > _FOR_GOOD

    return off_for_good


def _answer(bench: SimulatedBench, number: int) -> bool:
    """Wait for the old protocol's question and answer it."""
    heard = b""
    for _ in range(200):
        heard += bench.heater_board.read(4096)
        if heard.rstrip(b"\r\n").endswith(b"w"):
            bench.clock.sleep(0.002)
            bench.heater_board.write(str(number).encode())
            return True
        bench.clock.sleep(0.001)
    return False


# The recorder's host.


def _hosted(
    strike: Callable[[SimulatedBench, np.random.Generator], None],
    before: float = 0.0,
    setpoints: tuple[float, float] = (95.0, 90.0),
) -> Callable[[SimulatedBench, np.random.Generator, float], str]:
    """The recorder's control heats for a time [s], then something happens to the meter."""

    def heat(bench: SimulatedBench, random: np.random.Generator, watched: float) -> str:
        if not before:
            strike(bench, random)
            bench.clock.sleep(0.5)
        try:
            host = HeatingHost(bench, setpoints)
        except MuscleBayesError as error:
            return str(error)
        host.run(before)
        if before:
            strike(bench, random)
        host.run(watched - before)
        return host.stopped or ""

    return heat


def _shows(change: Shown) -> Callable[[SimulatedBench, np.random.Generator], None]:
    """The meter shows changed temperatures from now on."""

    def strike(bench: SimulatedBench, random: np.random.Generator) -> None:
        bench.thermometers.shows = change

    return strike


def _freeze(bench: SimulatedBench, random: np.random.Generator) -> None:
    bench.thermometers.frozen = True


def _garble(bench: SimulatedBench, random: np.random.Generator) -> None:
    if isinstance(bench.thermometers, BoardThermometers):
        bench.thermometers.garbled = True
    else:
        bench.meter.garble_from = lambda data: random.bytes(len(data))


TRIALS: Final[tuple[Trial, ...]] = (
    Trial("board: stuck at 25.0 C, full duty", _blind(255, lies.stuck)),
    Trial("board: stuck, 30 ms pause every 6 s", _blind(255, lies.stuck, 6.0, 0.03)),
    Trial("board: stuck, pause every 0.3 s", _blind(255, lies.stuck, 0.3, 0.03)),
    Trial("board: flickers by 0.1 C, full duty", _blind(255, lies.flickering)),
    Trial("board: readings fall, full duty", _blind(255, lies.falling)),
    Trial("board: stuck, half duty", _blind(127, lies.stuck)),
    Trial("board: stuck, duty 110", _blind(110, lies.stuck)),
    Trial("board: shows 40 % of the rise, full duty", _blind(255, lies.share(0.4))),
    Trial("board: shows 40 % of the rise, half duty", _blind(127, lies.share(0.4))),
    Trial("board: thermocouples swapped, full duty", _blind(255, lies.swapped)),
    Trial("board: stuck, faults cleared each time", _blind(255, lies.stuck, clear=True)),
    Trial("board: stuck, reset every few s", _blind_with_resets(ResetCause.EXTERNAL)),
    Trial("board: stuck, power cut every few s", _blind_with_resets(ResetCause.POWER_ON)),
    Trial(
        "board: stuck, power cut every 0.5 s", _blind_with_resets(ResetCause.POWER_ON, (0.5, 0.6))
    ),
    Trial("board: stuck, brown-outs", _blind_with_resets(ResetCause.BROWN_OUT, (1.0, 3.0))),
    Trial("board: off its tube, duty 50", _blind(50, lies.flickering)),
    Trial("board: off its tube, duty 25", _blind(25, lies.flickering)),
    Trial("board: stuck, bursts of full duty", _blind(255, lies.stuck, 1.0, 0.7)),
    Trial("board: 5 s late, full duty", _blind(255, lies.Late(5.0))),
    Trial("board: stuck at 80 C after a warm-up", _blind(180, lies.stuck_above(80.0))),
    Trial("board: drifts up by 0.3 C/s, half duty", _blind(127, lies.drifting(0.3))),
    Trial("board: noise of 3 C round 25 C", _blind(200, lies.Noisy(3.0))),
    *(
        Trial(f"{name}: {what}", heat, (name,))
        for name in THERMOMETERS
        for what, heat in (
            ("stuck, full duty", _blind(255, lies.stuck)),
            ("true, full duty, host blind", _blind(255, lies.share(1.0))),
            ("40 % of the rise, half duty", _blind(127, lies.share(0.4))),
            ("true, old protocol, full duty", _old(255)),
            ("stuck while holding", _hosted(_freeze, 60.0)),
        )
    ),
    Trial("board: old protocol, full duty", _old(255)),
    Trial("board: old protocol, half duty", _old(127)),
    Trial("board: old protocol, duty 110", _old(110)),
    Trial("host: meter off its tubes, flickers by 0.1 C", _hosted(_shows(lies.flickering))),
    Trial("host: meter in Fahrenheit", _hosted(_shows(lies.fahrenheit))),
    Trial("host: meter shows 40 % of the rise", _hosted(_shows(lies.share(0.4)))),
    Trial("host: meter shows 25 % of the rise", _hosted(_shows(lies.share(0.25)))),
    Trial("host: thermocouples swapped", _hosted(_shows(lies.swapped))),
    Trial("host: meter stuck while holding", _hosted(_freeze, 60.0)),
    Trial("host: readings fall while holding", _hosted(_shows(lies.falling), 60.0)),
    Trial("host: random answers while holding", _hosted(_garble, 60.0)),
)


def run_all(
    count: int,
    seed: int = 0,
    progress: Callable[[float], None] = lambda share: None,
    trials: Sequence[Trial] = TRIALS,
) -> list[Outcome]:
    """So many trials, the kinds by turns."""
    outcomes = []
    for number in range(count):
        outcomes.append(run(trials[number % len(trials)], seed + number // len(trials)))
        progress((number + 1) / count)
    return outcomes
