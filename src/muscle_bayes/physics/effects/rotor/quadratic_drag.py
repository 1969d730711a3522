"""Drag that grows with the square of speed."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class QuadraticDrag(Effect):
    """Q -> Q - c |q'| q'

    c: `coefficient` [N m s^2, or N s^2/m^2 where motion is linear].
    Source: drag at a constant drag coefficient, e.g. White, Fluid Mechanics, section 7.6.
    """

    name: ClassVar[str] = "quadratic-drag"
    port: ClassVar[Port] = "torque"
    dissipative: ClassVar[bool] = True
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "coefficient": Parameter(
            unit="N m s^2 or N s^2/m^2",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(0.1 * scales.force / scales.speed**2),
            meaning="generalised force per squared speed",
        ),
    }

    coefficient: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value - self.coefficient * jnp.abs(signals.speed) * signals.speed
