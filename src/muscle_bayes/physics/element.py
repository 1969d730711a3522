"""What hangs between rotor and stator on one side: nothing, a spring, a muscle, or an arm."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp

from muscle_bayes.conventions import GRAVITY, STRAIN_EPSILON
from muscle_bayes.physics.effect import Effect, Port, Signals
from muscle_bayes.physics.linkage import Linkage, Scalar
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.springs import reference_spring, tensile_spring


class Instant(NamedTuple):
    """Everything that acts on one side at one instant."""

    q: Scalar
    """Coordinate [rad or m]."""
    speed: Scalar
    """dq/dt [rad/s or m/s]."""
    hyst: Scalar
    """sigma_hyst of this side's muscle."""
    temperature: Scalar
    """Temperature of this side's muscle [C]."""
    load: Scalar
    """Hanging mass [kg]."""
    memory: Mapping[str, Scalar]
    """States of this side's effects with memory, by name."""


def through_port(
    effects: tuple[Effect, ...], port: Port, value: Scalar, signals: Signals
) -> Scalar:
    """`value` after every effect on `port`, in the order in which they were added."""
    for effect in effects:
        if effect.port == port:
            value = effect(value, signals)
    return value


class Element(eqx.Module):
    """One side's element."""

    relaxes: ClassVar[bool] = False
    """Whether sigma_hyst moves."""

    @abstractmethod
    def force(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        """Generalised force on q [N m or N]."""

    def hyst_rate(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        """d sigma_hyst/dt [1/s]; zero where there is no muscle."""
        return jnp.zeros_like(now.hyst)

    def inertia(self) -> float | Scalar:
        """Inertia that the element adds to the rotor's [kg m^2 or kg]."""
        return 0.0

    def strain(self, q: Scalar) -> Scalar:
        """sigma of the muscle; zero where there is none."""
        return jnp.zeros_like(q)


class NoElement(Element):
    """Nothing on this side."""

    def force(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        return jnp.zeros_like(now.q)


class ReferenceSpring(Element):
    """The reference spring (thesis, eq. 12): massless, lossless."""

    linkage: Linkage

    def force(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        return -reference_spring(self.linkage.length(now.q)) * self.linkage.lever(now.q)


class Spring(Element):
    """A linear spring on a linkage, with a damper beside it.

        tension = rate (L - free_length) + damping dL/dt

    rate [N/m], free_length [m], damping [N s/m]. Where the coils touch at `closed_length` [m] it pulls
    no more below that, over the same small strain as the other springs; None: it also pushes.
    """

    linkage: Linkage
    rate: Scalar | float
    free_length: Scalar | float
    closed_length: float | None
    damping: Scalar | float

    def force(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        length, lever = self.linkage.length(now.q), self.linkage.lever(now.q)
        tension = self.rate * (length - self.free_length)
        if self.closed_length is not None:
            slack = STRAIN_EPSILON * self.closed_length
            open_share = jnp.clip((length - self.closed_length) / slack + 1.0, 0.0, 1.0)
            least = self.rate * (self.closed_length - self.free_length)
            stretch = jnp.maximum(length - self.closed_length, 0.0)
            tension = open_share * least + self.rate * stretch
        return -(tension + self.damping * lever * now.speed) * lever


class TorsionSpring(Element):
    """Torque -(torque_at_zero + rate q + damping q'): N m, N m/rad, N m s/rad."""

    rate: Scalar | float
    torque_at_zero: Scalar | float
    damping: Scalar | float

    def force(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        return -(self.torque_at_zero + self.rate * now.q + self.damping * now.speed)


class Arm(Element):
    """Rigid pendulum arm: -m g d sin(theta - hanging_angle), inertia m d^2. kg, m, rad."""

    mass: float
    centre_distance: float
    hanging_angle: float

    def force(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        moment = self.mass * GRAVITY * self.centre_distance
        return -moment * jnp.sin(now.q - self.hanging_angle)

    def inertia(self) -> float | Scalar:
        return self.mass * self.centre_distance**2


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

    def _heated(self, now: Instant, effects: tuple[Effect, ...]) -> Signals:
        """What the effects see from which tension follows."""
        room, none = self.room_temperature, jnp.zeros_like(now.q)
        effective = room + self.heated_fraction * (now.temperature - room)  # eq. 11
        strain = self.strain(now.q)
        q, speed, hyst, _, load, memory = now
        seen = Signals(q, speed, load, strain, hyst, effective, room + none, none, none, memory)
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
