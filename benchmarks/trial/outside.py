"""Effects that no catalogue has, made for trials only: discovery must call them unknown."""

import math
from dataclasses import dataclass
from typing import ClassVar

from muscle_bayes.twin import Effect


class Outside(Effect):
    """An effect and the port that discovery should name."""

    port: ClassVar[str]


@dataclass(frozen=True, kw_only=True)
class Detent(Outside):
    """A torque that pulls towards one angle, such as a ball in a notch: -depth x exp((1 - x^2) / 2),
    x = (theta - at) / width."""

    name: ClassVar[str] = "detent"
    port: ClassVar[str] = "torque"
    depth: float = 0.006
    at: float = 0.4
    width: float = 0.15

    def extra_torque(self, angle: float, velocity: float) -> float:
        x = (angle - self.at) / self.width
        return -self.depth * x * math.exp(0.5 * (1.0 - x * x))


@dataclass(frozen=True, kw_only=True)
class OneWayFriction(Outside):
    """Friction that is larger one way: -level where the rotor turns up, as a ratchet's pawl."""

    name: ClassVar[str] = "one-way-friction"
    port: ClassVar[str] = "torque"
    level: float = 0.004

    def extra_torque(self, angle: float, velocity: float) -> float:
        return -self.level * 0.5 * (1.0 + math.tanh(velocity / 0.02))


@dataclass(frozen=True, kw_only=True)
class GlassTransition(Outside):
    """Strain gained about a temperature: size / (1 + exp(-(T - at) / width))."""

    name: ClassVar[str] = "glass-transition"
    port: ClassVar[str] = "offset"
    size: float = 0.012
    at: float = 55.0
    width: float = 2.0

    def extra_offset(self, temperature: float) -> float:
        return self.size / (1.0 + math.exp(-(temperature - self.at) / self.width))


@dataclass(frozen=True, kw_only=True)
class DamperPeak(Outside):
    """HYST's damper is stiffer about one temperature: times 1 + size exp(-((T - at) / width)^2)."""

    name: ClassVar[str] = "damper-peak"
    port: ClassVar[str] = "damper"
    size: float = 3.0
    at: float = 60.0
    width: float = 8.0

    def damper(self, coefficient: float, temperature: float) -> float:
        return coefficient * (
            1.0 + self.size * math.exp(-(((temperature - self.at) / self.width) ** 2))
        )


@dataclass(frozen=True, kw_only=True)
class WiperRipple(Outside):
    """The potentiometer's wiper ripples: angle + size sin(waves angle)."""

    name: ClassVar[str] = "wiper-ripple"
    port: ClassVar[str] = "reading"
    size: float = 0.012
    waves: float = 9.0

    def shown(self, angle: float) -> float:
        return angle + self.size * math.sin(self.waves * angle)


@dataclass(frozen=True, kw_only=True)
class Tether(Outside):
    """A strand beside the muscle that pulls in a middle range of strains only, as if it snagged."""

    name: ClassVar[str] = "tether"
    port: ClassVar[str] = "tension"
    size: float = 0.6
    at: float = 0.08
    width: float = 0.02

    def extra_tension(self, strain: float) -> float:
        return self.size * math.exp(-(((strain - self.at) / self.width) ** 2))


OUTSIDE: dict[str, type[Outside]] = {
    kind.name: kind
    for kind in (Detent, OneWayFriction, GlassTransition, DamperPeak, WiperRipple, Tether)
}
