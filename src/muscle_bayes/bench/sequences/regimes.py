"""The thesis' test regimes as sequences. Loads in kg, temperatures in C.

What the thesis does not say and is chosen here: the setpoints of the staircase and of T1's sweep,
T1's loads and lower peaks, the number of cycles where it says "until repeatable", all waits.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

from muscle_bayes.bench.sequences.sequence import Repeat, RunPlan, Stage
from muscle_bayes.bench.sequences.sequence import Sequence as BenchSequence
from muscle_bayes.data.describing.sizes import check_mass
from muscle_bayes.errors import MuscleBayesError

HOT: Final = 90.0
TEST_LOADS: Final = (0.139, 0.166, 0.212)
TRAINING_LOAD: Final = 0.060
CLIMB: Final = (32.0, 40.0, 48.0, 56.0, 64.0, 72.0, 80.0, 85.0, HOT)
REPEATABLE: Final = 3.0
"""Counts within which a motion is taken to repeat."""

T_LOAD: Final = 0.275
T1_LOADS: Final = (0.275, 0.475, 0.675, 0.875, 1.075)
T1_PEAKS: Final = (90.0, 80.0, 70.0, 60.0, 50.0, 40.0)
T1_CYCLES: Final = 5
T2_LOADS: Final = (0.700, 0.850, 1.000, 1.150)
T2_TEMPERATURES: Final = (25.0, 50.0, 70.0, 90.0)


def training(room: float) -> BenchSequence:
    """Cycles to 90 C at a small load, until the motion repeats; restores the short length."""
    stages = (Stage(setpoint_a=HOT), Stage(setpoint_a=room))
    block = Repeat(repeat=5, until_within=REPEATABLE, stages=stages)
    return BenchSequence(load=TRAINING_LOAD, stage=(Stage(setpoint_a=room, duration=10.0), block))


def staircase(
    room: float, loads: Sequence[float] = TEST_LOADS, *, cycles: int = 3
) -> BenchSequence:
    """A run a load: training, then steps up to 90 C and back to the room, repeated."""
    steps = tuple(Stage(setpoint_a=at) for at in CLIMB)
    runs = tuple(
        RunPlan(
            name=f"staircase-{grams(load)}",
            load=TRAINING_LOAD,
            stage=(
                *_trained(room, load),
                Repeat(repeat=cycles, stages=(*steps, Stage(setpoint_a=room))),
            ),
        )
        for load in loads
    )
    return BenchSequence(protocol="staircase", run=runs)


def sawtooth(room: float, loads: Sequence[float] = TEST_LOADS) -> BenchSequence:
    """Training, then fast cycles to 90 C; the load grows between cycles, at room temperature."""
    first, *others = loads
    cycle = Repeat(repeat=2, stages=(Stage(setpoint_a=HOT), Stage(setpoint_a=room, wait=60.0)))
    blocks: list[Stage | Repeat] = [*_trained(room, first), cycle]
    for load in others:
        pour = Stage(setpoint_a=room, duration=20.0, load=load, pour_time=4.0)
        blocks += [pour, cycle]
    run = RunPlan(name="sawtooth", load=TRAINING_LOAD, stage=tuple(blocks))
    return BenchSequence(protocol="sawtooth", run=(run,))


def t1(room: float) -> BenchSequence:
    """T1: at rising loads, 5 cycles to a peak, then a sweep up to it; a run a peak, from 90 C down.

    Every run begins with 5 cycles to 90 C at 275 g, so that no peak's run inherits from another.
    """
    runs = []
    for peak in T1_PEAKS:
        sweep = [Stage(setpoint_a=at) for at in _sweep(room, peak)]
        blocks: list[Stage | Repeat] = [_cycles(room, HOT)]
        for load in T1_LOADS:
            hang = Stage(setpoint_a=room, load=load, duration=20.0)
            blocks += [hang, _cycles(room, peak), *sweep, Stage(setpoint_a=room)]
        runs.append(RunPlan(name=f"t1-{peak:g}c", load=T_LOAD, stage=tuple(blocks)))
    return BenchSequence(run=tuple(runs))


def t2(room: float) -> BenchSequence:
    """T2: 256 runs, one for each pair of starting and ending loads and temperatures.

    Each begins with the steps i and ii (90 C at 275 g, cooled), which after another permutation are
    its ix and x, and so depends on no other: any may be left out, or recorded another day.
    """
    runs = []
    for start, end, warm, hot in product(T2_LOADS, T2_LOADS, T2_TEMPERATURES, T2_TEMPERATURES):
        warm, hot = (max(at, room) for at in (warm, hot))
        stages = (
            Stage(setpoint_a=HOT, load=T_LOAD),
            Stage(setpoint_a=room),
            Stage(setpoint_a=room, load=start, duration=20.0),
            Stage(setpoint_a=warm),
            Stage(setpoint_a=room),
            Stage(setpoint_a=room, load=end, duration=20.0),
            Stage(setpoint_a=hot),
            Stage(setpoint_a=HOT),
        )
        name = f"t2-{grams(start)}-{warm:g}c-{grams(end)}-{hot:g}c"
        runs.append(RunPlan(name=name, load=T_LOAD, stage=stages))
    return BenchSequence(run=tuple(runs))


@dataclass(frozen=True)
class Regime:
    """A regime by name."""

    build: Callable[[float], BenchSequence]
    """room temperature [C] -> sequence"""
    about: str


REGIMES: Final = {
    "staircase": Regime(staircase, "setpoint in steps up to 90 C and back, a run a load"),
    "sawtooth": Regime(sawtooth, "fast cycles to 90 C, load poured on in between"),
    "training": Regime(training, "cycles to 90 C at 60 g until the motion repeats"),
    "t1": Regime(t1, "cycles and sweeps at rising loads, six runs of falling peak temperature"),
    "t2": Regime(t2, "256 permutations of starting and ending load and temperature"),
}


def with_loads(name: str, room: float, loads: Sequence[float] = ()) -> BenchSequence:
    """A regime by name, at other test loads [kg] where it has any. Raises MuscleBayesError."""
    if not loads:
        return REGIMES[name].build(room)
    taking: dict[str, Callable[[float, Sequence[float]], BenchSequence]] = {
        "staircase": staircase,
        "sawtooth": sawtooth,
    }
    if name not in taking:
        raise MuscleBayesError(
            f"{name} has loads of its own. Fix: give masses to {' or '.join(taking)} only, or "
            "change the sequence's file."
        )
    for load in loads:
        if load <= 0.0:
            raise MuscleBayesError(f"--mass {load:g}: no load. Fix: give kg, above 0.")
        try:
            check_mass(load)
        except ValueError as error:
            raise MuscleBayesError(f"--mass{error}.") from None
    return taking[name](room, loads)


def grams(load: float) -> str:
    """A load [kg] as in names of runs."""
    return f"{1000 * load:g}g"


def _trained(room: float, load: float) -> tuple[Stage | Repeat, ...]:
    """Training that is not logged, then the load, then 10 s of rest that are."""
    cycle = (Stage(setpoint_a=HOT, logged=False), Stage(setpoint_a=room, logged=False))
    return (
        Repeat(repeat=2, stages=cycle),
        Stage(setpoint_a=room, duration=30.0, load=load, pour_time=2.0, logged=False),
        Stage(setpoint_a=room, duration=10.0),
    )


def _cycles(room: float, peak: float) -> Repeat:
    return Repeat(repeat=T1_CYCLES, stages=(Stage(setpoint_a=peak), Stage(setpoint_a=room)))


def _sweep(room: float, peak: float) -> list[float]:
    return [at for at in (30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0) if room + 2.0 < at <= peak]
