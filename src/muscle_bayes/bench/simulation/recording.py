"""The simulated bench as the recorder's devices, with somebody who hangs its loads."""

from typing import Any, Final

from muscle_bayes.bench.boards.board import Board
from muscle_bayes.bench.boards.link import Devices, Link
from muscle_bayes.bench.meters.board_meter import BoardMeter
from muscle_bayes.bench.meters.meter import Meter, MeterSource
from muscle_bayes.bench.sequences.sequence import RIG_TABLES, LoadCell, Sequence
from muscle_bayes.bench.simulation.bench import SimulatedBench
from muscle_bayes.bench.simulation.chips import (
    COUNTER_MIDDLE,
    ENCODER_SCALE,
    LOAD_SCALE,
    LOAD_ZERO,
)
from muscle_bayes.bench.simulation.plant import TwinPlant
from muscle_bayes.data import MuscleElement, NoElement, Potentiometer, SpringElement
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin.metadata import describe
from muscle_bayes.twin.overrides import override
from muscle_bayes.twin.plant.rig import Rig
from muscle_bayes.twin.protocols import Stage, free

NOTES: Final = (
    "Synthetic: recorded from the real firmware in simavr with the simulator of this project as "
    "plant, not measured."
)
_REACTION: Final = 0.5
"""s that the simulated operator takes to press the key."""
_TURNS, _HOLDS = 2.0, 1.0
"""s in which the simulated hand turns the rotor, and for which it holds it at an endstop."""


def simulated_devices(bench: SimulatedBench) -> Devices:
    """Both boards and the meter of a simulated bench; links that were lost open again."""
    clock = bench.clock

    def board(line: Any, name: str) -> Board:
        opened = Board(line, clock, name)
        opened.identify()
        return opened

    heater = Link("heater board", lambda: board(bench.heater_board, "heater board"), clock)

    def meter() -> MeterSource:
        if bench.own_thermometers:
            return BoardMeter(heater, clock)
        return Meter(bench.meter, clock)

    return Devices(
        sensor=Link("sensor board", lambda: board(bench.sensor_board, "sensor board"), clock),
        heater=heater,
        meter=Link("meter", meter, clock),
        clock=clock,
    )


class SimulatedOperator:
    """Presses the key half a second after being asked, and pours from then on, evenly."""

    def __init__(self, bench: SimulatedBench, load: float) -> None:
        """`load` [kg] hangs at first."""
        self._bench = bench
        self._load = load
        self._asked: tuple[float, float, float] | None = None
        """since when [s], load [kg] and time of the pour [s]"""
        self._pour: tuple[float, float, float, float] | None = None
        """start [s], duration [s], load before and after [kg]"""
        bench.listeners.append(self._pour_on)

    def ask(self, load: float, pour_time: float) -> None:
        self._asked = (self._bench.clock.now(), load, pour_time)

    def poll(self) -> str | None:
        if self._asked is None:
            return None
        since, load, pour_time = self._asked
        now = self._bench.clock.now()
        if now - since < _REACTION:
            return None
        self._asked, self._pour = None, (now, pour_time, self._load, load)
        return "go"

    def _pour_on(self, milliseconds: int) -> None:
        if self._pour is None:
            return
        start, duration, before, after = self._pour
        passed = milliseconds / 1000 - start
        if passed >= duration:
            self._load, self._pour = after, None
        else:
            self._load = before + (after - before) * max(passed, 0.0) / duration
        self._bench.plant.hang(self._load)


def rig_of(sequence: Sequence, rig: Rig) -> Rig:
    """A rig with the tables that a sequence gives of it. Raises MuscleBayesError."""
    values: dict[str, Any] = {}
    for name in RIG_TABLES:
        table = getattr(sequence, name)
        if table is None:
            continue
        if not isinstance(table, MuscleElement | SpringElement | NoElement) and name[:-1] == (
            "element_"
        ):
            raise MuscleBayesError(f"{name}: an arm cannot be simulated. Fix: another kind.")
        for key, value in table.model_dump(exclude_none=True).items():
            if (key, value) in (("motion", "rotary"), ("linkage", "pins")):
                continue
            if key in ("motion", "linkage"):
                raise MuscleBayesError(
                    f"{name}.{key}: {value!r} cannot be simulated. Fix: leave it out."
                )
            values[f"{name}.{key}"] = value
    return override(rig, values)


def rig_tables(rig: Rig, bench: SimulatedBench | None = None) -> dict[str, Any]:
    """A rig as the tables of NAME.toml, its sensors those of a bench."""
    about = describe(rig, free([Stage(duration=1.0)]), ([0.0], [0.0]))
    tables = {name: getattr(about, name) for name in RIG_TABLES}
    if bench is not None and "encoder" in bench.sensors:
        zero = COUNTER_MIDDLE - bench.plant.angle / ENCODER_SCALE
        tables["potentiometer"] = Potentiometer(
            zero_reading=zero, radians_per_count=ENCODER_SCALE, zero_uncertainty=1.0, bits=16
        )
    if bench is not None and "hx711" in bench.sensors:
        tables["load_cell"] = LoadCell(zero=float(LOAD_ZERO), kg_per_count=LOAD_SCALE)
    return tables


class SimulatedHand:
    """Turns the rotor from one endstop to the other and back, holding it at each."""

    def __init__(self, bench: SimulatedBench, plant: TwinPlant) -> None:
        """The first endstop is the lower one."""
        self._plant = plant
        self._start = bench.clock.now()
        bench.listeners.append(self._move)

    def _move(self, milliseconds: int) -> None:
        lower, upper = self._plant.rig.fixture.stops
        leg = _TURNS + _HOLDS
        passed = (milliseconds / 1000 - self._start + 0.5 * _TURNS) % (2 * leg)
        share = min(passed % leg / _TURNS, 1.0)
        ends = (upper, lower) if passed < leg else (lower, upper)
        self._plant.turn(ends[0] + share * (ends[1] - ends[0]))
