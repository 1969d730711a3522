"""The coiled-nylon muscle as an element."""

from typing import ClassVar

import jax.numpy as jnp

from muscle_bayes.physics.effect import Effect, Signals
from muscle_bayes.physics.elements.element import Element, Instant, through_port
from muscle_bayes.physics.linkage import Linkage, Scalar
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.springs import tensile_spring, tensile_strain


class Muscle(Element):
    """The muscle of eq. 13-17 on its linkage.

    `heated_fraction` is L_heater / L_muscle of eq. 11, with L_muscle = L_base.
    """

    relaxes: ClassVar[bool] = True
    linkage: Linkage
    base_length: float
    heated_fraction: float
    room_temperature: float
    parameters: MuscleParameters

    def strain(self, q: Scalar) -> Scalar:
        return (self.linkage.length(q) - self.base_length) / self.base_length

    def hyst_under(self, tension: Scalar, q: Scalar, temperature: Scalar) -> Scalar:
        """sigma_hyst with which the muscle, effects aside, pulls so much [N] at q and a temperature [C]."""
        muscle, room = self.parameters, self.room_temperature
        effective = room + self.heated_fraction * (temperature - room)
        rigid = self.base_length * muscle.K_modulus
        stretch = tensile_strain(tension, rigid, muscle.F_modulus_min)
        return self.strain(q) - muscle.offset(effective) - stretch

    def _heated(self, now: Instant, effects: tuple[Effect, ...]) -> Signals:
        """What the effects see from which tension follows."""
        room, none = self.room_temperature, jnp.zeros_like(now.q)
        effective = room + self.heated_fraction * (now.temperature - room)  # eq. 11
        strain = self.strain(now.q)
        q, speed, hyst, _, load, memory = now
        seen = Signals(q, speed, load, strain, hyst, effective, room + none, *3 * (none,), memory)
        return seen._replace(temperature=through_port(effects, "temperature", effective, seen))

    def signals(self, now: Instant, effects: tuple[Effect, ...]) -> Signals:
        """What the effects see, the tension of MODULUS, OFFSET and HYST in series included (eq. 14)."""
        seen, muscle = self._heated(now, effects), self.parameters
        offset = through_port(effects, "offset", muscle.offset(seen.temperature), seen)
        rigid = self.base_length * muscle.K_modulus
        stiffness = through_port(effects, "modulus", rigid, seen)
        stretch = seen.strain - offset - seen.hyst
        return seen._replace(tension=tensile_spring(stretch, stiffness, muscle.F_modulus_min))

    def tension(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        """Tension [N], eq. 14 and the effects on the tension port."""
        signals = self.signals(now, effects)
        return through_port(effects, "tension", signals.tension, signals)

    def force(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        return -self.tension(now, effects) * self.linkage.lever(now.q)

    def hyst_rate(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        """Eq. 15: (F_modulus - F_hyst) / (B_hyst L_base)."""
        signals, muscle = self.signals(now, effects), self.parameters
        held = tensile_spring(now.hyst, self.base_length * muscle.K_hyst, muscle.F_hyst_min)
        flow = through_port(effects, "flow", signals.tension - held, signals)
        damper = through_port(effects, "damper", muscle.damper(signals.temperature), signals)
        return flow / (damper * self.base_length)
