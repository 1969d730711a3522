"""Effects that a twin can hide from the inference.

An effect overrides one or more ports of `Effect`; the twin calls only the ports that an effect
overrides. Names and parameters are those the inference uses for the same effect.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import ClassVar

from muscle_bayes.errors import MuscleBayesError

Follower = Callable[[float, float], float]
"""Heater's temperature at an interval's end [C] and its length [s] -> muscle's temperature [C]."""


@dataclass(frozen=True, kw_only=True)
class Effect:
    """Ports, each of which leaves the twin as it is."""

    name: ClassVar[str] = ""

    def extra_torque(self, angle: float, velocity: float) -> float:
        """Torque to add on the rotor, N m; angle in rad, velocity in rad/s."""
        return 0.0

    def extra_tension(self, strain: float) -> float:
        """Tension to add in parallel with the whole muscle, N."""
        return 0.0

    def extra_offset(self, temperature: float) -> float:
        """Strain to add to sigma_offset (eq. 16)."""
        return 0.0

    def damper(self, coefficient: float, temperature: float) -> float:
        """Damper coefficient in place of B_hyst (eq. 17), N s/m."""
        return coefficient

    def follow(self, heater: float) -> Follower:
        """Follower of the muscle's temperature; its heater's starts at `heater` [C]."""
        return lambda temperature, duration: temperature

    def reading(self, counts: float) -> float:
        """Potentiometer reading before noise and rounding, counts."""
        return counts

    def overrides(self, port: str) -> bool:
        return getattr(type(self), port) is not getattr(Effect, port)


@dataclass(frozen=True, kw_only=True)
class ViscousFriction(Effect):
    """Torque -coefficient * omega; coefficient in N m s."""

    name: ClassVar[str] = "viscous-friction"
    coefficient: float = 5e-4

    def extra_torque(self, angle: float, velocity: float) -> float:
        return -self.coefficient * velocity


@dataclass(frozen=True, kw_only=True)
class BiasTorque(Effect):
    """Constant torque on the rotor, N m."""

    name: ClassVar[str] = "bias-torque"
    torque: float = 0.003

    def extra_torque(self, angle: float, velocity: float) -> float:
        return self.torque


@dataclass(frozen=True, kw_only=True)
class CoilContact(Effect):
    """Touching coils push: tension + stiffness (sigma - onset) for sigma < onset (eq. 18, onset 0).

    stiffness in N per unit strain; acts beside the series chain, so HYST does not feel it.
    """

    name: ClassVar[str] = "coil-contact"
    stiffness: float = 100.0
    onset: float = 0.0

    def extra_tension(self, strain: float) -> float:
        return self.stiffness * (strain - self.onset) if strain < self.onset else 0.0


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


EFFECTS: dict[str, type[Effect]] = {
    kind.name: kind for kind in (ViscousFriction, BiasTorque, CoilContact, ThermalLag)
}


def make_effect(name: str, **values: float) -> Effect:
    """Effect of that name with those parameters."""
    if name not in EFFECTS:
        raise MuscleBayesError(f"unknown effect {name!r}; known: {', '.join(sorted(EFFECTS))}")
    kind = EFFECTS[name]
    known = [field.name for field in fields(kind)]
    for key in values:
        if key not in known:
            raise MuscleBayesError(
                f"effect {name!r} has no parameter {key!r}; it has: {', '.join(known)}"
            )
    return kind(**values)


def parse_effect(text: str) -> Effect:
    """Effect from NAME or NAME:param=value,param=value."""
    name, _, rest = text.partition(":")
    values: dict[str, float] = {}
    for item in filter(None, rest.split(",")):
        key, separator, value = item.partition("=")
        try:
            values[key.strip()] = float(value)
        except ValueError:
            separator = ""
        if not separator:
            raise MuscleBayesError(
                f"effect {text!r}: {item!r} is not param=value with a number for value"
            )
    return make_effect(name.strip(), **values)
