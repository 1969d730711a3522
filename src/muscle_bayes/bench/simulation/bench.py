"""Two boards, a meter and a plant in lockstep on one virtual clock."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, Self

import numpy as np

from muscle_bayes.bench.boards.messages import ResetCause, Role
from muscle_bayes.bench.heat.heat_model import TubeModel
from muscle_bayes.bench.sensors.catalogue import thermometer_of, wiring_of
from muscle_bayes.bench.simulation.chips import BoardThermometers, SensorChips
from muscle_bayes.bench.simulation.links import Link
from muscle_bayes.bench.simulation.meter import MeterEmulator
from muscle_bayes.bench.simulation.plant import TwinPlant
from muscle_bayes.bench.simulation.processor import Processor
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

    `sensors` are names of SENSORS that the boards are wired to. With thermometers among them the meter
    stays where it is, and `thermometers` is what the heater board reads; without, both are one.

    `sensor_board`, `heater_board` and `meter` are transports. `sensor` and `heater` are the
    processors themselves, `meter_device` the meter: for looking inside and for injecting faults.
    """

    def __init__(
        self,
        plant: TwinPlant | None = None,
        seed: int = 0,
        *,
        calibrated: bool = True,
        sensors: Sequence[str] = (),
        elf: Path | None = None,
    ) -> None:
        """`elf` is the heater board's program, the built one where it is not given."""
        self.plant = TwinPlant(seed=seed) if plant is None else plant
        rig = self.plant.rig
        self.sensor = Processor(heater=False)
        self.heater = Processor(heater=True, elf=elf)
        if calibrated:
            tube = TubeModel.of(rig.heater.full_rate, rig.heater.cooling_time)
            self.heater.store_tubes((tube, tube))
        self.meter_device = MeterEmulator(rig.meter, generators(seed)["meter"])
        self.sensors = tuple(sensors)
        self._wire_sensors(sensors, seed)
        self.sensor_board = _board_link(self.sensor, "simulated sensor board")
        self.heater_board = _board_link(self.heater, "simulated heater board")
        self.meter = Link(self.meter_device, "simulated meter")
        self.listeners: list[Listener] = []
        self.clock = VirtualClock(self._step)
        self._milliseconds = 0
        self._show()

    def _wire_sensors(self, sensors: Sequence[str], seed: int) -> None:
        at_heater, at_sensor = (wiring_of(sensors, role) for role in (Role.HEATER, Role.SENSOR))
        self.own_thermometers = thermometer_of(at_heater) is not None
        self._chips = SensorChips(self.sensor, at_sensor, np.random.default_rng([seed, 1]))
        self.thermometers: MeterEmulator | BoardThermometers = self.meter_device
        if self.own_thermometers:
            random = np.random.default_rng([seed, 2])
            self.thermometers = BoardThermometers(self.heater, at_heater, random)
        self.heater.store_wiring(at_heater)
        self.sensor.store_wiring(at_sensor)

    def _show(self) -> None:
        """What the plant shows to everything that measures."""
        plant, time = self.plant, self._milliseconds * STEP
        self.sensor.set_analog(plant.counts())
        self._chips.step(plant.angle, plant.load, plant.counts_2())
        self.meter_device.step(time, plant.temperatures())
        if self.own_thermometers:
            self.thermometers.step(time, plant.temperatures())

    def _step(self) -> None:
        self._milliseconds += 1
        self.sensor.run(1)
        duties = self.heater.run(1)
        self.plant.blow(self.heater.fan)
        self.plant.advance(duties, STEP)
        self._show()
        for listener in self.listeners:
            listener(self._milliseconds)

    def close(self) -> None:
        """Free the simulators."""
        self.sensor.close()
        self.heater.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
