"""A linear spring on a linkage, with a damper beside it."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from numpyro import distributions as dist

from muscle_bayes.conventions import STRAIN_EPSILON
from muscle_bayes.physics.effect import Effect, Scales
from muscle_bayes.physics.elements.element import Element, Instant
from muscle_bayes.physics.linkage import Linkage, Scalar
from muscle_bayes.physics.unknown import UNKNOWN, Unknown


def _lever(size: Scales) -> float:
    return size.force / size.tension


class Spring(Element):
    """tension = tension_at_zero + rate (L(q) - L(0)) + damping dL/dt

    rate [N/m], tension_at_zero [N], damping [N s/m]. `free_length` [m], where the spring's line pulls
    with no force, may be stated instead of tension_at_zero; NaN: it is not. Where the coils touch at
    `closed_length` [m] it pulls no more below that, over the same small strain as the other springs;
    None: it also pushes. Source: Hooke's law with a dashpot beside it (Kelvin and Voigt).
    """

    unknowns: ClassVar[Mapping[str, Unknown]] = {
        "rate": Unknown(
            unit="N/m",
            prior=lambda size: dist.LogNormal(
                np.log(size.force / size.range / _lever(size) ** 2), 2.0
            ),
            meaning="rate of the spring",
        ),
        "tension_at_zero": Unknown(
            unit="N",
            prior=lambda size: dist.Normal(0.0, 3.0 * size.tension),
            meaning="pull of the spring at coordinate zero",
        ),
        "damping": Unknown(
            unit="N s/m",
            prior=lambda size: dist.HalfNormal(size.force / size.speed / _lever(size) ** 2),
            meaning="damper beside the spring",
        ),
    }

    linkage: Linkage
    rate: Scalar | float = UNKNOWN
    tension_at_zero: Scalar | float = UNKNOWN
    damping: Scalar | float = UNKNOWN
    free_length: Scalar | float = UNKNOWN
    closed_length: float | None = None

    def estimated(self) -> tuple[str, ...]:
        """The fields to be estimated: no pull at zero where the free length is stated."""
        names = super().estimated()
        stated = not np.isnan(np.asarray(self.free_length))
        return tuple(name for name in names if not (stated and name == "tension_at_zero"))

    def _at_zero(self) -> tuple[Scalar, Scalar]:
        """Length and tension at coordinate zero."""
        length = self.linkage.length(jnp.zeros(()))
        by_length = self.rate * (length - self.free_length)
        return length, jnp.where(jnp.isnan(self.free_length), self.tension_at_zero, by_length)

    def tension(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        length, lever = self.linkage.length(now.q), self.linkage.lever(now.q)
        middle, pull = self._at_zero()
        tension = pull + self.rate * (length - middle)
        if self.closed_length is not None:
            slack = STRAIN_EPSILON * self.closed_length
            open_share = jnp.clip((length - self.closed_length) / slack + 1.0, 0.0, 1.0)
            least = pull + self.rate * (self.closed_length - middle)
            stretch = jnp.maximum(length - self.closed_length, 0.0)
            tension = open_share * least + self.rate * stretch
        return tension + self.damping * lever * now.speed

    def force(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        return -self.tension(now, effects) * self.linkage.lever(now.q)
