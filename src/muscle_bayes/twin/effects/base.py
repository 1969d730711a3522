"""What an effect that a twin can hide from the inference may change.

An effect overrides one or more ports of `Effect`; the twin calls only the ports that an effect
overrides. Names and parameters are those the inference uses for the same effect.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol

Follower = Callable[[float, float], float]
"""Heater's temperature at an interval's end [C] and its length [s] -> muscle's temperature [C]."""
View = Callable[[float, float], float]
"""Angle [rad] and time since the first row [s] -> angle that the potentiometer takes [rad]."""


class Creep(Protocol):
    """A strain in series with the muscle's elements that has a history of its own."""

    strain: float

    def advance(self, step: float, tension: float, temperature: float) -> None:
        """Let a step [s] pass under a tension [N] at a temperature [C]."""

    def rewind(self, fraction: float) -> None:
        """Keep only that fraction of the last advance."""


@dataclass(frozen=True, kw_only=True)
class Effect:
    """Ports, each of which leaves the twin as it is."""

    name: ClassVar[str] = ""

    def load_torque(self, torque: float) -> float:
        """Torque of the hanging mass in place of m g R_d, N m."""
        return torque

    def extra_torque(self, angle: float, velocity: float) -> float:
        """Torque to add on the rotor, N m; angle in rad, velocity in rad/s."""
        return 0.0

    def dry_friction(self, level: float, speed: float, pull: float, angle: float) -> float:
        """Dry friction in place of D at a speed (no sign) [rad/s] and an angle [rad], N m.

        pull: magnitudes of the torques of both sides and of the load, added up, N m.
        """
        return level

    def extra_tension(self, strain: float) -> float:
        """Tension to add in parallel with the whole muscle, N."""
        return 0.0

    def extra_offset(self, temperature: float) -> float:
        """Strain to add to sigma_offset (eq. 16)."""
        return 0.0

    def stretch(self, stretch: float) -> float:
        """Stretch of MODULUS in place of sigma - sigma_offset - sigma_hyst."""
        return stretch

    def modulus(self, stiffness: float, temperature: float) -> float:
        """Stiffness of MODULUS in place of L_base K_modulus, N per unit strain."""
        return stiffness

    def damper(self, coefficient: float, temperature: float) -> float:
        """Damper coefficient in place of B_hyst (eq. 17), N s/m."""
        return coefficient

    def flow(self, force: float) -> float:
        """Force that makes HYST's damper flow in place of F_modulus - F_hyst (eq. 15), N."""
        return force

    def creep(self, room: float) -> Creep | None:
        """Strain with a history, for one muscle in a room [C]."""
        return None

    def follow(self, heater: float) -> Follower:
        """Follower of the muscle's temperature; its heater's starts at `heater`, the room's [C]."""
        return lambda temperature, duration: temperature

    def shown(self, angle: float) -> float:
        """Angle that the potentiometer takes, rad."""
        return angle

    def view(self) -> View:
        """What a potentiometer with a history takes; of one without, `shown`."""
        return lambda angle, time: self.shown(angle)

    def reading(self, counts: float) -> float:
        """Potentiometer reading before noise and rounding, counts."""
        return counts

    def temperature_delay(self) -> float:
        """By how much later than the angle temperatures are logged, s."""
        return 0.0

    def overrides(self, port: str) -> bool:
        return getattr(type(self), port) is not getattr(Effect, port)
