"""The muscle follows its thermometer late."""

from collections.abc import Mapping
from typing import ClassVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Parameter, TemperatureFilter
from muscle_bayes.physics.linkage import Scalar


class ThermalLag(TemperatureFilter):
    """tau dT_muscle/dt = T - T_muscle

    tau: `time_constant` [s]. For T linear over an interval h, from T_0 to T_1 with slope r,
    T_muscle(h) = T_1 - tau r + (T_muscle(0) - T_0 + tau r) exp(-h / tau): exact, also at tau = 0.
    Source: lumped capacity, e.g. Incropera, Fundamentals of Heat and Mass Transfer, section 5.1.
    """

    name: ClassVar[str] = "thermal-lag"
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "time_constant": Parameter(
            unit="s",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(20.0),
            meaning="delay of the muscle behind its thermometer",
        )
    }

    time_constant: Scalar

    def __call__(
        self, time: Float[Array, " node"], course: Float[Array, " node"]
    ) -> Float[Array, " node"]:
        """From steady state at the first node."""
        ends = course[:-1], course[1:], jnp.diff(time)
        _, rest = jax.lax.scan(lambda late, step: (self.advance(late, *step),) * 2, course[0], ends)
        return jnp.concatenate([course[:1], rest])

    def advance(self, late: Scalar, before: Scalar, after: Scalar, duration: Scalar) -> Scalar:
        tau = jnp.asarray(self.time_constant)
        moving = duration > 0.0
        slope = jnp.where(moving, (after - before) / jnp.where(moving, duration, 1.0), 0.0)
        positive = tau > 0.0
        decay = jnp.where(positive, jnp.exp(-duration / jnp.where(positive, tau, 1.0)), 0.0)
        lagged = after - tau * slope + (late - before + tau * slope) * decay
        return jnp.where(moving, lagged, late)
