"""Effects between what the sensors show and what the muscle and the rotor do."""

import math
from dataclasses import dataclass
from typing import ClassVar

from muscle_bayes.twin.effects.base import Effect, Follower, View


@dataclass(frozen=True, kw_only=True)
class ThermalLag(Effect):
    """The muscle follows its heater with a first-order time constant, s."""

    name: ClassVar[str] = "thermal-lag"
    time_constant: float = 5.0

    def follow(self, heater: float) -> Follower:
        muscle = before = heater

        def follower(temperature: float, duration: float) -> float:
            """Exact for a heater temperature that changes linearly in between."""
            nonlocal muscle, before
            tau = self.time_constant
            if tau <= 0.0:
                return temperature
            if duration > 0.0:
                slope = (temperature - before) / duration
                lag = muscle - before + slope * tau
                muscle = temperature - slope * tau + lag * math.exp(-duration / tau)
            before = temperature
            return muscle

        return follower


@dataclass(frozen=True, kw_only=True)
class PartialHeating(Effect):
    """A share `unheated` of what lies in the heater stays at room temperature (eq. 11)."""

    name: ClassVar[str] = "partial-heating"
    unheated: float = 0.15

    def follow(self, heater: float) -> Follower:
        share, room = self.unheated, heater
        return lambda temperature, duration: share * room + (1.0 - share) * temperature


@dataclass(frozen=True, kw_only=True)
class PotentiometerNonlinearity(Effect):
    """The potentiometer shows angle + gain angle + bend angle^2; bend in 1/rad."""

    name: ClassVar[str] = "potentiometer-nonlinearity"
    gain: float = 0.02
    bend: float = 0.03

    def shown(self, angle: float) -> float:
        return (1.0 + self.gain) * angle + self.bend * angle * angle


@dataclass(frozen=True, kw_only=True)
class ZeroDrift(Effect):
    """The potentiometer shows angle + rate t, t since the log's first row; rate in rad/s."""

    name: ClassVar[str] = "zero-drift"
    rate: float = 5e-5

    def view(self) -> View:
        return lambda angle, time: angle + self.rate * time


@dataclass(frozen=True, kw_only=True)
class Backlash(Effect):
    """The potentiometer follows the rotor only where it leaves a gap of so many rad."""

    name: ClassVar[str] = "backlash"
    gap: float = 0.03

    def view(self) -> View:
        half, middle = 0.5 * self.gap, None

        def view(angle: float, time: float) -> float:
            nonlocal middle
            middle = angle if middle is None else middle
            middle = min(max(middle, angle - half), angle + half)
            return middle

        return view


@dataclass(frozen=True, kw_only=True)
class ClockOffset(Effect):
    """Temperatures are logged `delay` [s] later than the angles of the same instant."""

    name: ClassVar[str] = "clock-offset"
    delay: float = 1.0

    def temperature_delay(self) -> float:
        return self.delay
