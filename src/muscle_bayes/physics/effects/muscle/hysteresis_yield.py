"""Dry friction inside HYST: below a yield force it does not flow."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class HysteresisYield(Effect):
    """F_damper -> F_damper - min(max(F_damper, -Y), Y)

    F_damper: force over HYST's damper; Y: `force` that it withstands at rest [N].
    Source: the thesis' suggestion for the drift at room temperature, a Coulomb element in HYST;
    Bingham, Fluidity and Plasticity (1922).
    """

    name: ClassVar[str] = "hysteresis-yield"
    port: ClassVar[Port] = "flow"
    dissipative: ClassVar[bool] = False
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "force": Parameter(
            unit="N",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(0.3 * scales.tension),
            meaning="force below which HYST does not flow",
        ),
    }

    force: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value - jnp.minimum(jnp.maximum(value, -self.force), self.force)
