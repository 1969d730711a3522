"""Dry friction that is higher at rest than while sliding."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class StribeckFriction(Effect):
    """D -> D + b exp(-(q' / v_s)^2)

    b: `breakaway`, what friction withstands at rest above what it is while sliding [N m, or N where
    motion is linear]; v_s: Stribeck `speed` [rad/s, or m/s].
    Source: Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994), section 2.
    """

    name: ClassVar[str] = "stribeck-friction"
    port: ClassVar[Port] = "friction"
    dissipative: ClassVar[bool] = True
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "breakaway": Parameter(
            unit="N m or N",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(0.1 * scales.force),
            meaning="dry friction at rest above that while sliding",
        ),
        "speed": Parameter(
            unit="rad/s or m/s",
            off=1.0,
            prior=lambda scales: dist.LogNormal(np.log(0.1 * scales.speed), 1.0),
            meaning="speed at which little of it is left",
        ),
    }

    breakaway: Scalar
    speed: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value + self.breakaway * jnp.exp(-((signals.speed / self.speed) ** 2))
