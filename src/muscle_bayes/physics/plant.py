"""The plant: one coordinate, an element on each side, a load, friction, and a tuple of effects."""

import dataclasses
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.physics.effect import Effect, MemoryEffect, Port, Signals, TemperatureFilter
from muscle_bayes.physics.element import Element, Instant, Muscle, through_port
from muscle_bayes.physics.friction import FrictionLaw
from muscle_bayes.physics.linkage import Scalar

LOCATING_STEPS = 4
"""Newton steps from a reading to the coordinate; sensors are nearly straight."""


class Drive(NamedTuple):
    """What is imposed on the plant at one instant."""

    temperature: Float[Array, "2"]
    """Muscle temperature of sides A and B [C]."""
    load: Scalar
    """Hanging mass [kg]."""
    applied: Scalar
    """Known generalised force [N m or N]."""


class Plant(eqx.Module):
    """inertia(load) q'' = force(q, q', hyst, drive) - dry friction;  hyst' = hyst_rate(...)

    `rotor_inertia` is J [kg m^2] (its mass [kg] where motion is linear). `load_lever` is R_d [m], or
    1 where motion is linear: the load pulls with m g load_lever and adds m load_lever^2.
    `plant + effect` is the plant with one more effect; their order is part of the model. `memory` is
    held while coordinate and HYST move.
    """

    rotor_inertia: Scalar
    friction: FrictionLaw
    side_a: Element
    side_b: Element
    load_lever: float
    stops: tuple[float, float]
    effects: tuple[Effect | TemperatureFilter, ...] = ()
    memory: dict[str, Float[Array, "2"]] = eqx.field(default_factory=dict)
    """States of the effects with memory on sides A and B, by name; empty where nothing is remembered,
    and such effects do nothing there."""

    def __add__(self, effect: Effect | TemperatureFilter) -> "Plant":
        return eqx.tree_at(
            lambda plant: plant.effects,
            self,
            (*self.effects, effect),
            is_leaf=lambda node: node is self.effects,
        )

    @property
    def instant_effects(self) -> tuple[Effect, ...]:
        """The effects that correct a port at an instant, given what is remembered."""
        return tuple(
            effect
            for effect in self.effects
            if isinstance(effect, Effect)
            and (effect.name in self.memory or not isinstance(effect, MemoryEffect))
        )

    def corrects(self, port: Port) -> bool:
        """Whether any effect corrects what this port carries."""
        return any(effect.port == port for effect in self.instant_effects)

    def acts_on(self, port: Port) -> Bool[Array, ""]:
        """Whether any effect on this port is not off: has no parameters, or one not at its off value.

        No derivative is seen through this: one that is off counts as absent, with its slopes there.
        """
        on = [
            jnp.asarray(getattr(effect, key) != parameter.off)
            for effect in self.instant_effects
            if effect.port == port
            for key, parameter in effect.parameters.items()
        ]
        bare = any(not effect.parameters for effect in self.instant_effects if effect.port == port)
        return jnp.stack([jnp.asarray(bare), *on]).any()

    @property
    def muscles(self) -> dict[int, Muscle]:
        """The muscles by side: 0 is A, 1 is B."""
        sides = (self.side_a, self.side_b)
        return {place: side for place, side in enumerate(sides) if isinstance(side, Muscle)}

    @property
    def memory_effects(self) -> tuple[MemoryEffect, ...]:
        """The effects with a state, none where no muscle has it."""
        found = (effect for effect in self.effects if isinstance(effect, MemoryEffect))
        return tuple(found) if self.muscles else ()

    def remembering(self, memory: dict[str, Float[Array, "2"]]) -> "Plant":
        """The plant with these states of its effects with memory."""
        return dataclasses.replace(self, memory=memory)

    @property
    def temperature_filters(self) -> tuple[TemperatureFilter, ...]:
        """The effects that look at the temperature's whole course."""
        return tuple(effect for effect in self.effects if isinstance(effect, TemperatureFilter))

    def inertia(self, load: Scalar) -> Scalar:
        """J + m R_d^2 + what the elements add [kg m^2 or kg]."""
        elements = self.side_a.inertia() + self.side_b.inertia()
        return self.rotor_inertia + load * self.load_lever**2 + elements

    def instants(
        self,
        q: Scalar,
        speed: Scalar,
        hyst: Float[Array, "2"] | tuple[Scalar, Scalar],
        drive: Drive,
    ) -> tuple[Instant, Instant]:
        """What acts on sides A and B."""
        a, b = (
            Instant(q, speed, hyst[side], drive.temperature[side], drive.load, self._recalled(side))
            for side in (0, 1)
        )
        return a, b

    def _recalled(self, side: int) -> dict[str, Scalar]:
        return {name: states[side] for name, states in self.memory.items()}

    def signals(self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Signals:
        """What effects on the torque, friction and reading ports see: muscle signals are side A's."""
        strain, none = self.side_a.strain(q), jnp.zeros_like(q)
        heat, memory = drive.temperature[0], self._recalled(0)
        return Signals(q, speed, drive.load, strain, hyst[0], heat, none, none, none, memory)

    def dry_friction(
        self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"], drive: Drive
    ) -> Scalar:
        """Magnitude of dry friction at a speed [N m or N]; at rest, the force that it withstands."""
        seen = self.signals(q, speed, hyst, drive)
        seen = seen._replace(pull=self._pull(q, speed, hyst, drive))
        return through_port(self.instant_effects, "friction", self.friction.dry, seen)

    def _pull(self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
        """Magnitudes of the generalised forces of both sides, the load and the drive, added up."""
        effects = self.instant_effects
        a, b = self.instants(q, speed, hyst, drive)
        elements = jnp.abs(self.side_a.force(a, effects)) + jnp.abs(self.side_b.force(b, effects))
        load = drive.load * GRAVITY * self.load_lever
        return elements + jnp.abs(load) + jnp.abs(drive.applied)

    @eqx.filter_jit  # traced once wherever a program asks for it
    def force(self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
        """Generalised force [N m or N] of everything but dry friction."""
        effects = self.instant_effects
        a, b = self.instants(q, speed, hyst, drive)
        elements = self.side_a.force(a, effects) + self.side_b.force(b, effects)
        load = drive.load * GRAVITY * self.load_lever
        smooth = elements + load + drive.applied - self.friction.viscous * speed
        return through_port(effects, "torque", smooth, self.signals(q, speed, hyst, drive))

    def hyst_rates(
        self,
        q: Scalar,
        speed: Scalar,
        hyst: Float[Array, "2"] | tuple[Scalar, Scalar],
        drive: Drive,
    ) -> tuple[Scalar, Scalar]:
        """d sigma_hyst/dt of side A and of side B [1/s]."""
        effects = self.instant_effects
        a, b = self.instants(q, speed, hyst, drive)
        return self.side_a.hyst_rate(a, effects), self.side_b.hyst_rate(b, effects)

    def hyst_rate(
        self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"], drive: Drive
    ) -> Float[Array, "2"]:
        """d sigma_hyst/dt of both sides [1/s]."""
        return jnp.stack(self.hyst_rates(q, speed, hyst, drive))

    def sensed(self, q: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
        """Coordinate [rad or m] that the sensor shows when the plant is at q."""
        signals = self.signals(q, jnp.zeros_like(q), hyst, drive)
        return through_port(self.instant_effects, "reading", q, signals)

    def located(self, shown: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
        """Coordinate [rad or m] at which the sensor shows `shown`: `sensed` inverted, by Newton."""
        q = shown
        if self.corrects("reading"):
            for _ in range(LOCATING_STEPS):
                unit = jnp.ones_like(q)
                seen, slope = jax.jvp(lambda x: self.sensed(x, hyst, drive), (q,), (unit,))
                q = q + (shown - seen) / jnp.where(slope == 0.0, 1.0, slope)
        return q
