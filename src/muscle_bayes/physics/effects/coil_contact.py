"""Neighbouring coils touch when the muscle gets short."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
import numpyro.distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class CoilContact(Effect):
    """F -> F + K_contact min(sigma - sigma_onset, 0)

    K_contact: `stiffness` [N per unit strain]; sigma_onset: `onset`, the strain at which the first
    coils touch [-]. Source: thesis, eq. 18 (onset 0, very stiff); its test T1 shows a gradual loss
    of contraction below 5 % strain, hence the softer stiffness and earlier onset that the prior admits.
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
    }

    stiffness: Scalar
    onset: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value + self.stiffness * jnp.minimum(signals.strain - self.onset, 0.0)
