"""Effects on the rotor's bearing."""

import math
from dataclasses import dataclass
from typing import ClassVar

from muscle_bayes.twin.effects.base import Effect


@dataclass(frozen=True, kw_only=True)
class ViscousFriction(Effect):
    """Torque -coefficient * omega; coefficient in N m s."""

    name: ClassVar[str] = "viscous-friction"
    coefficient: float = 5e-4

    def extra_torque(self, angle: float, velocity: float) -> float:
        return -self.coefficient * velocity


@dataclass(frozen=True, kw_only=True)
class Cogging(Effect):
    """Torque sine sin(waves theta) + cosine cos(waves theta), N m."""

    name: ClassVar[str] = "cogging"
    sine: float = 0.006
    cosine: float = 0.0
    waves: float = 8.0

    def extra_torque(self, angle: float, velocity: float) -> float:
        phase = self.waves * angle
        return self.sine * math.sin(phase) + self.cosine * math.cos(phase)


@dataclass(frozen=True, kw_only=True)
class BiasTorque(Effect):
    """Constant torque on the rotor, N m."""

    name: ClassVar[str] = "bias-torque"
    torque: float = 0.003

    def extra_torque(self, angle: float, velocity: float) -> float:
        return self.torque


@dataclass(frozen=True, kw_only=True)
class QuadraticDrag(Effect):
    """Torque -coefficient * |omega| omega; coefficient in N m s^2."""

    name: ClassVar[str] = "quadratic-drag"
    coefficient: float = 3e-4

    def extra_torque(self, angle: float, velocity: float) -> float:
        return -self.coefficient * abs(velocity) * velocity


@dataclass(frozen=True, kw_only=True)
class StribeckFriction(Effect):
    """At rest dry friction is higher by `breakaway` [N m]; that fades with (omega / speed)^2 [rad/s]."""

    name: ClassVar[str] = "stribeck-friction"
    breakaway: float = 0.004
    speed: float = 0.3

    def dry_friction(self, level: float, speed: float, pull: float, angle: float) -> float:
        return level + self.breakaway * math.exp(-((speed / self.speed) ** 2))


@dataclass(frozen=True, kw_only=True)
class LoadDependentFriction(Effect):
    """A share of all that pulls at the rotor is added to dry friction."""

    name: ClassVar[str] = "load-dependent-friction"
    share: float = 0.015

    def dry_friction(self, level: float, speed: float, pull: float, angle: float) -> float:
        return level + self.share * pull


@dataclass(frozen=True, kw_only=True)
class PositionDependentFriction(Effect):
    """Dry friction is exp(slope theta) times as high; slope in 1/rad."""

    name: ClassVar[str] = "position-dependent-friction"
    slope: float = 2.0

    def dry_friction(self, level: float, speed: float, pull: float, angle: float) -> float:
        return level * math.exp(self.slope * angle)


@dataclass(frozen=True, kw_only=True)
class ForceScale(Effect):
    """The load pulls harder than its stated mass by a share `error`."""

    name: ClassVar[str] = "force-scale"
    error: float = 0.05

    def load_torque(self, torque: float) -> float:
        return torque * (1.0 + self.error)
