"""What acts between rotor and stator on one side."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import jax.numpy as jnp

from muscle_bayes.physics.effect import Effect, Port, Signals
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.unknown import Part


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


class Element(Part):
    """One side's element."""

    relaxes: ClassVar[bool] = False
    """Whether sigma_hyst moves."""

    @abstractmethod
    def force(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        """Generalised force on q [N m or N]."""

    def tension(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        """What a load cell in the element's line shows: its tension [N], or torque [N m] against q."""
        return -self.force(now, effects)

    def hyst_rate(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        """d sigma_hyst/dt [1/s]; zero where there is no muscle."""
        return jnp.zeros_like(now.hyst)

    def inertia(self) -> float | Scalar:
        """Inertia that the element adds to the rotor's [kg m^2 or kg]."""
        return 0.0

    def strain(self, q: Scalar) -> Scalar:
        """sigma of the muscle; zero where there is none."""
        return jnp.zeros_like(q)
