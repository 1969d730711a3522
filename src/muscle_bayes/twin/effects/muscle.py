"""Effects on the muscle's elements."""

import math
from dataclasses import dataclass
from typing import ClassVar

from muscle_bayes.twin.effects.base import Effect


def _gradual(depth: float, span: float) -> float:
    """Integral from 0 to depth of a ramp that rises from 0 to 1 over a span, then stays at 1."""
    if depth <= 0.0:
        return 0.0
    if depth < span:
        return depth * depth / (2.0 * span)
    return depth - 0.5 * span


@dataclass(frozen=True, kw_only=True)
class CoilContact(Effect):
    """Touching coils push: tension + stiffness (sigma - onset) for sigma < onset (eq. 18, onset 0).

    stiffness in N per unit strain, reached once sigma is `width` below onset; acts beside the series
    chain, so HYST does not feel it.
    """

    name: ClassVar[str] = "coil-contact"
    stiffness: float = 100.0
    onset: float = 0.0
    width: float = 0.0

    def extra_tension(self, strain: float) -> float:
        return -self.stiffness * _gradual(self.onset - strain, self.width)


@dataclass(frozen=True, kw_only=True)
class Slack(Effect):
    """Parts of the muscle go taut one after the other, over stretches from 0 to `span`."""

    name: ClassVar[str] = "slack"
    span: float = 0.04

    def stretch(self, stretch: float) -> float:
        return _gradual(stretch, self.span) if stretch > 0.0 else stretch


@dataclass(frozen=True, kw_only=True)
class ModulusTemperature(Effect):
    """MODULUS loses a share `softening` of its stiffness with each kelvin above 25 C."""

    name: ClassVar[str] = "modulus-temperature"
    softening: float = 0.006

    def modulus(self, stiffness: float, temperature: float) -> float:
        return stiffness / math.exp(self.softening * (temperature - 25.0))


@dataclass(frozen=True, kw_only=True)
class DamperLaw(Effect):
    """HYST's damper of eq. 17 times a factor that is 1 at 25 C: Arrhenius' where shape is 1.

    activation_temperature: activation energy over the gas constant, K; shape: exponent n of
    ((298.15 K / T)^n - 1) / n, which takes the place of 298.15 K / T - 1.
    """

    name: ClassVar[str] = "damper-law"
    activation_temperature: float = 1500.0
    shape: float = 1.0

    def damper(self, coefficient: float, temperature: float) -> float:
        kelvin = temperature + 273.15
        cooler = ((298.15 / kelvin) ** self.shape - 1.0) / (self.shape * 298.15)
        return coefficient * math.exp(self.activation_temperature * cooler)


@dataclass(frozen=True, kw_only=True)
class HysteresisYield(Effect):
    """HYST does not flow under less than `force` [N], and under more by what is above."""

    name: ClassVar[str] = "hysteresis-yield"
    force: float = 0.3

    def flow(self, force: float) -> float:
        return math.copysign(max(abs(force) - self.force, 0.0), force)
