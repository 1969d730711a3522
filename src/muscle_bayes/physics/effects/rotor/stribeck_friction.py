"""Dry friction that is higher at rest than while sliding."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class StribeckFriction(Effect):
    """D -> D (1 - f (1 - exp(-(q' / v_s)^2)))

    f: `drop`, the share of friction at rest that is lost while sliding fast [-]; v_s: Stribeck `speed`
    [rad/s, or m/s]. So D is what friction withstands at rest, which is what slow motion tells.
    Source: Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994), section 2, with
    F_c = D (1 - f) and F_s = D.
    """

    name: ClassVar[str] = "stribeck-friction"
    port: ClassVar[Port] = "friction"
    dissipative: ClassVar[bool] = True
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "drop": Parameter(
            unit="1",
            off=0.0,
            prior=lambda scales: dist.Beta(1.0, 2.0),
            meaning="share of dry friction at rest that is lost while sliding",
        ),
        "speed": Parameter(
            unit="rad/s or m/s",
            off=1.0,
            prior=lambda scales: dist.LogNormal(np.log(0.1 * scales.speed), 1.0),
            meaning="speed at which most of that is lost",
        ),
    }

    drop: Scalar
    speed: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value * (1.0 + self.drop * jnp.expm1(-((signals.speed / self.speed) ** 2)))
