"""A torsion spring on the rotor, with a damper beside it."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect
from muscle_bayes.physics.elements.element import Element, Instant
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.unknown import UNKNOWN, Unknown


class TorsionSpring(Element):
    """Q = -(tension_at_zero + rate q + damping q')

    tension_at_zero [N m], rate [N m/rad], damping [N m s/rad]. Source: Hooke's law with a dashpot
    beside it (Kelvin and Voigt).
    """

    unknowns: ClassVar[Mapping[str, Unknown]] = {
        "rate": Unknown(
            unit="N m/rad",
            prior=lambda size: dist.LogNormal(np.log(size.force / size.range), 2.0),
            meaning="rate of the torsion spring",
        ),
        "tension_at_zero": Unknown(
            unit="N m",
            prior=lambda size: dist.Normal(0.0, 3.0 * size.force),
            meaning="torque of the spring at angle zero",
        ),
        "damping": Unknown(
            unit="N m s/rad",
            prior=lambda size: dist.HalfNormal(size.force / size.speed),
            meaning="damper beside the spring",
        ),
    }

    rate: Scalar | float = UNKNOWN
    tension_at_zero: Scalar | float = UNKNOWN
    damping: Scalar | float = UNKNOWN

    def force(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        return -(self.tension_at_zero + self.rate * now.q + self.damping * now.speed)
