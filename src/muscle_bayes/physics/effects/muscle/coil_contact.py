"""Neighbouring coils touch when the muscle gets short."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.springs import lost_stretch


class CoilContact(Effect):
    """F -> F - K_contact (d - c (1 - c / (2 w))),   d = max(sigma_onset - sigma, 0),   c = min(d, w)

    K_contact: `stiffness` [N per unit strain]; sigma_onset: `onset`, the strain at which the first
    coils touch [-]; w: `width`, the strains over which the others follow, evenly [-]. With w = 0 all
    touch at once. Source: thesis, eq. 18 (onset 0, width 0, very stiff). Its test T1 shows a gradual loss
    of contraction below 5 % strain: onset and width near 0.05.
    """

    name: ClassVar[str] = "coil-contact"
    port: ClassVar[Port] = "tension"
    dissipative: ClassVar[bool] = False
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "stiffness": Parameter(
            unit="N",
            off=0.0,
            prior=lambda scales: dist.HalfCauchy(50.0 * scales.tension),
            meaning="contact force per unit strain",
        ),
        "onset": Parameter(
            unit="1",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 0.03),
            meaning="strain below which coils touch",
        ),
        "width": Parameter(
            unit="1",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(0.03),
            meaning="span of strains over which coils begin to touch",
        ),
    }

    stiffness: Scalar
    onset: Scalar
    width: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        depth = jnp.maximum(self.onset - signals.strain, 0.0)
        return value - self.stiffness * (depth - lost_stretch(depth, self.width))
