"""The plant: one coordinate, an element on each side, a load, friction, and a tuple of effects."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.physics.effect import Effect, Signals, TemperatureFilter
from muscle_bayes.physics.element import Element, Instant, through_port
from muscle_bayes.physics.friction import FrictionLaw
from muscle_bayes.physics.linkage import Scalar


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
    `plant + effect` is the plant with one more effect; their order is part of the model.
    """

    rotor_inertia: Scalar
    friction: FrictionLaw
    side_a: Element
    side_b: Element
    load_lever: float
    stops: tuple[float, float]
    effects: tuple[Effect | TemperatureFilter, ...] = ()

    def __add__(self, effect: Effect | TemperatureFilter) -> "Plant":
        return eqx.tree_at(
            lambda plant: plant.effects,
            self,
            (*self.effects, effect),
            is_leaf=lambda node: node is self.effects,
        )

    @property
    def instant_effects(self) -> tuple[Effect, ...]:
        """The effects without memory."""
        return tuple(effect for effect in self.effects if isinstance(effect, Effect))

    @property
    def temperature_filters(self) -> tuple[TemperatureFilter, ...]:
        """The effects on the temperature port that remember."""
        return tuple(effect for effect in self.effects if isinstance(effect, TemperatureFilter))

    def inertia(self, load: Scalar) -> Scalar:
        """J + m R_d^2 + what the elements add [kg m^2 or kg]."""
        elements = self.side_a.inertia() + self.side_b.inertia()
        return self.rotor_inertia + load * self.load_lever**2 + elements

    def _instants(
        self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"], drive: Drive
    ) -> tuple[Instant, Instant]:
        a, b = (
            Instant(q, speed, hyst[side], drive.temperature[side], drive.load) for side in (0, 1)
        )
        return a, b

    def signals(self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Signals:
        """What effects on the torque and reading ports see: muscle signals are side A's."""
        strain = self.side_a.strain(q)
        return Signals(q, speed, drive.load, strain, hyst[0], drive.temperature[0])

    def force(self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
        """Generalised force [N m or N] of everything but dry friction."""
        effects = self.instant_effects
        a, b = self._instants(q, speed, hyst, drive)
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
        a, b = self._instants(q, speed, hyst, drive)
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
