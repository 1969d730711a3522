"""A rigid pendulum arm."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from numpyro import distributions as dist

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.physics.effect import Effect
from muscle_bayes.physics.elements.element import Element, Instant
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.unknown import UNKNOWN, Unknown

ANYWHERE = 0.3
"""Prior standard deviation of the angle at which an arm hangs, about where its readings have it [rad]."""


class Arm(Element):
    """Q = -moment sin(q - hanging_angle), inertia added to the rotor's

    moment [N m]: m g d; `moment_of_inertia` [kg m^2]: m d^2 of a point mass; hanging_angle [rad].
    """

    unknowns: ClassVar[Mapping[str, Unknown]] = {
        "moment": Unknown(
            unit="N m",
            prior=lambda size: dist.LogNormal(np.log(size.force), 2.0),
            meaning="weight of the arm times the distance of its centre, m g d",
        ),
        "moment_of_inertia": Unknown(
            unit="kg m^2",
            prior=lambda size: dist.LogNormal(np.log(size.force * size.range / size.speed**2), 2.0),
            meaning="inertia of the arm about the axis",
        ),
        "hanging_angle": Unknown(
            unit="rad",
            prior=lambda size: dist.Normal(size.rest, ANYWHERE),
            meaning="angle at which the arm hangs",
        ),
    }

    moment: Scalar | float = UNKNOWN
    moment_of_inertia: Scalar | float = UNKNOWN
    hanging_angle: Scalar | float = UNKNOWN

    @classmethod
    def of_mass(cls, mass: float, centre_distance: float, hanging_angle: float = 0.0) -> "Arm":
        """The arm of a point mass [kg] at a distance [m] from the axis."""
        moment = mass * GRAVITY * centre_distance
        return cls(moment, mass * centre_distance**2, hanging_angle)

    def force(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        return -self.moment * jnp.sin(now.q - self.hanging_angle)

    def inertia(self) -> float | Scalar:
        return self.moment_of_inertia
