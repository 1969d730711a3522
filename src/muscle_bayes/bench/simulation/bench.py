"""Two boards, a meter and a plant in lockstep on one virtual clock."""

from collections.abc import Callable
from types import TracebackType
from typing import Final, Self

from muscle_bayes.bench.boards.protocol import ResetCause
from muscle_bayes.bench.heat.heat_model import TubeModel
from muscle_bayes.bench.simulation.links import Link
from muscle_bayes.bench.simulation.meter import MeterEmulator
from muscle_bayes.bench.simulation.plant import Plant, TwinPlant
from muscle_bayes.bench.simulation.processor import Processor
from muscle_bayes.twin.rig import Rig
from muscle_bayes.twin.simulate import generators

STEP: Final = 1e-3
"""Lockstep, s: plant, boards and meter exchange values this often."""

Listener = Callable[[int], None]
"""Called after each step with the number of milliseconds that have passed."""


class VirtualClock:
    """A clock whose `sleep` makes the simulation go on; nothing else does."""

    def __init__(self, step: Callable[[], None]) -> None:
        self._step = step
        self._now = 0.0
        self._steps = 0

    def now(self) -> float:
        return self._now

    def sleep(self, seconds: float) -> None:
        end = self._now + max(seconds, 0.0)
        while (self._steps + 1) * STEP <= end + 1e-9:
            self._steps += 1
            self._now = self._steps * STEP
            self._step()
        self._now = max(end, self._now)


def _board_link(processor: Processor, name: str) -> Link:
    def reset() -> None:
        processor.drop_unsent()
        processor.reset(ResetCause.EXTERNAL)

    return Link(processor, name, reset)


class SimulatedBench:
    """The real firmware on two simulated boards, wired to a plant. Equal arguments, equal bytes.

    The heater board is calibrated for the plant's tubes, unless `calibrated` is false.

    `sensor_board`, `heater_board` and `meter` are transports. `sensor` and `heater` are the
    processors themselves, `meter_device` the meter: for looking inside and for injecting faults.
    """

    def __init__(
        self, plant: Plant | None = None, seed: int = 0, *, calibrated: bool = True
    ) -> None:
        self.plant: Plant = TwinPlant(seed=seed) if plant is None else plant
        rig = plant.rig if isinstance(plant, TwinPlant) else Rig()
        self.sensor = Processor(heater=False)
        self.heater = Processor(heater=True)
        if calibrated:
            tube = TubeModel.of(rig.heater.full_rate, rig.heater.cooling_time)
            self.heater.store_tubes((tube, tube))
        self.meter_device = MeterEmulator(rig.meter, generators(seed)["meter"])
        self.sensor_board = _board_link(self.sensor, "simulated sensor board")
        self.heater_board = _board_link(self.heater, "simulated heater board")
        self.meter = Link(self.meter_device, "simulated meter")
        self.listeners: list[Listener] = []
        self.clock = VirtualClock(self._step)
        self._milliseconds = 0
        self._wire()

    def _wire(self) -> None:
        self.sensor.set_analog(self.plant.counts())
        self.meter_device.step(0.0, self.plant.temperatures())

    def _step(self) -> None:
        self._milliseconds += 1
        self.sensor.run(1)
        duties = self.heater.run(1)
        self.plant.advance(duties, STEP)
        self.sensor.set_analog(self.plant.counts())
        self.meter_device.step(self._milliseconds * STEP, self.plant.temperatures())
        for listener in self.listeners:
            listener(self._milliseconds)

    def close(self) -> None:
        """Free the simulators."""
        self.sensor.close()
        self.heater.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
