"""A torque that is periodic in the coordinate, as of magnets, gear teeth or a bent shaft."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class Cogging(Effect):
    """Q -> Q + a sin(w q) + b cos(w q)

    a, b: `sine` and `cosine` [N m, or N where motion is linear]; w: `waves`, phase per coordinate [rad/rad,
    or rad/m]. The prior of w spans about 1 to 36 periods over the range of motion.
    Source: Jahns and Soong, IEEE Transactions on Industrial Electronics 43 (1996), pulsating torque.
    """

    name: ClassVar[str] = "cogging"
    port: ClassVar[Port] = "torque"
    dissipative: ClassVar[bool] = False
    scanned: ClassVar[int] = 128
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "sine": Parameter(
            unit="N m or N",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 0.1 * scales.force),
            meaning="amplitude of the part in phase with the coordinate",
        ),
        "cosine": Parameter(
            unit="N m or N",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 0.1 * scales.force),
            meaning="amplitude of the part a quarter of a period ahead",
        ),
        "waves": Parameter(
            unit="rad/rad or rad/m",
            off=1.0,
            prior=lambda scales: dist.LogNormal(np.log(12.0 * np.pi / scales.range), 1.1),
            meaning="phase per coordinate",
        ),
    }

    sine: Scalar
    cosine: Scalar
    waves: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        phase = self.waves * signals.q
        return value + self.sine * jnp.sin(phase) + self.cosine * jnp.cos(phase)
