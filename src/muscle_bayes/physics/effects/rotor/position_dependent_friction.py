"""Dry friction that differs along the way, as of a bent shaft or a bearing that wears in the middle."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class PositionDependentFriction(Effect):
    """D -> D exp(s q)

    s: `slope` [1/rad, or 1/m where motion is linear] of the logarithm of dry friction.
    Source: Armstrong-Helouvry, Control of Machines with Friction (1991), position-dependent friction, whose
    first order in position this is.
    """

    name: ClassVar[str] = "position-dependent-friction"
    port: ClassVar[Port] = "friction"
    dissipative: ClassVar[bool] = True
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "slope": Parameter(
            unit="1/rad or 1/m",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 1.0 / scales.range),
            meaning="rise of the logarithm of dry friction with the coordinate",
        ),
    }

    slope: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value * jnp.exp(self.slope * signals.q)
