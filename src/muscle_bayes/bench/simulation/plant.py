"""The plant on the simulated boards' pins: heater duty in, angle sensor and temperatures out."""

from typing import Final

import numpy as np

from muscle_bayes.twin.bench import Bench
from muscle_bayes.twin.plant.rig import Rig
from muscle_bayes.twin.sensors import AngleSensor
from muscle_bayes.twin.simulate import generators

SECOND_OFFSET: Final = -30.0
"""By so much the second potentiometer's zero reading differs from what is stated of the first, counts."""


class TwinPlant:
    """The twin's rotor, muscles and heater tubes. Equal arguments give equal plants.

    load in kg; angle [rad] is where the rotor is held at first, None = in equilibrium; hyst is the
    muscles' initial sigma_hyst.
    """

    def __init__(
        self,
        rig: Rig | None = None,
        *,
        load: float = 0.060,
        angle: float | None = None,
        hyst: float = 0.02,
        seed: int = 0,
    ) -> None:
        self.rig = rig or Rig()
        self.bench = Bench(self.rig, load=load, hyst=hyst)
        self.bench.place(angle)
        self.load = load
        streams = generators(seed)
        spread = self.rig.potentiometer.zero_spread
        self.zero_reading = self.rig.potentiometer.zero_reading + float(
            streams["zero"].uniform(-spread, spread)
        )
        self._sensor = AngleSensor(
            self.rig.potentiometer,
            self.zero_reading,
            streams["potentiometer"],
            self.rig.truth.effects,
        )
        self._second = AngleSensor(
            self.rig.potentiometer,
            self.rig.potentiometer.zero_reading + SECOND_OFFSET,
            np.random.default_rng([seed, 3]),
        )

    def advance(self, duties: tuple[float, float], duration: float) -> None:
        """Let a time [s] pass at these mean heater duties (0-255)."""
        for channel, duty in zip(self.bench.channels, duties, strict=True):
            channel.pwm = duty
        self.bench.advance(duration)

    def counts(self) -> int:
        """What the angle sensor's converter would read now, 0-1023."""
        return self._sensor.read(self.bench.rotor.angle)

    def counts_2(self) -> int:
        """What a second potentiometer's converter would read now, 0-1023."""
        return self._second.read(self.bench.rotor.angle)

    @property
    def angle(self) -> float:
        """Of the rotor, rad."""
        return float(self.bench.rotor.angle)

    def blow(self, on: bool) -> None:
        """Whether the fan blows on the tubes from now on."""
        heater = self.rig.heater
        for channel in self.bench.channels:
            share = heater.fan if on else 1.0
            channel.tube.cooling_time = share * heater.cooling_time

    def temperatures(self) -> tuple[float, float]:
        """Of both heater tubes, C."""
        first, second = self.bench.channels
        return first.tube.temperature, second.tube.temperature

    def hang(self, mass: float) -> None:
        """Change the load [kg]."""
        self.load = mass
        self.bench.rotor.hang(mass)

    def turn(self, angle: float) -> None:
        """Hold the rotor at an angle [rad] by hand and let go."""
        self.bench.place(angle)
