"""Friction of the rotor's bearing."""

from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.physics.linkage import Scalar


class FrictionLaw(eqx.Module):
    """Friction split into a dry part, which sticks, and a part proportional to speed."""

    @property
    @abstractmethod
    def dry(self) -> Scalar:
        """Magnitude of dry friction [N m or N]: motion starts when the other forces exceed it."""

    @property
    @abstractmethod
    def viscous(self) -> Scalar:
        """Coefficient of the part proportional to speed [N m s or N s/m]."""


class CoulombFriction(FrictionLaw):
    """Generalised force -D sign(q'), any value in [-D, D] at rest: it really sticks."""

    D: Scalar

    @property
    def dry(self) -> Scalar:
        return self.D

    @property
    def viscous(self) -> Scalar:
        return jnp.zeros_like(jnp.asarray(self.D))


class LinearFriction(FrictionLaw):
    """Generalised force -D q': never sticks."""

    D: Scalar

    @property
    def dry(self) -> Scalar:
        return jnp.zeros_like(jnp.asarray(self.D))

    @property
    def viscous(self) -> Scalar:
        return self.D


FRICTION_LAWS: dict[str, type[FrictionLaw]] = {
    "coulomb": CoulombFriction,
    "linear": LinearFriction,
}


def friction_law(name: str) -> type[FrictionLaw]:
    """The law of this name. Raises MuscleBayesError where there is none."""
    if name not in FRICTION_LAWS:
        known = " or ".join(FRICTION_LAWS)
        raise MuscleBayesError(f"friction {name!r} is not known. Fix: use {known}.")
    return FRICTION_LAWS[name]
