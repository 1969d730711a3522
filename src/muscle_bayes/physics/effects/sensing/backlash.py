"""Play between the rotor and its sensor: gears, couplings, loose pins."""

from collections.abc import Mapping
from typing import ClassVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Parameter, ReadingFilter
from muscle_bayes.physics.linkage import Scalar


class Backlash(ReadingFilter):
    """shown -> max(q - g / 2, min(q + g / 2, shown))

    g: `gap`, by which the rotor moves before the sensor follows it after a reversal [rad, or m where
    motion is linear]. In a run's first row the sensor is in the middle of its gap.
    Source: the play operator, Brokate and Sprekels, Hysteresis and Phase Transitions (1996), section 2.1.
    """

    name: ClassVar[str] = "backlash"
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "gap": Parameter(
            unit="rad or m",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(0.05 * scales.range),
            meaning="motion that the sensor misses after a reversal",
        ),
    }

    gap: Scalar

    def __call__(
        self, time: Float[Array, " instant"], course: Float[Array, " instant"]
    ) -> Float[Array, " instant"]:
        def follow(shown: Scalar, q: Scalar) -> tuple[Scalar, Scalar]:
            shown = jnp.clip(shown, q - 0.5 * self.gap, q + 0.5 * self.gap)
            return shown, shown

        return jax.lax.scan(follow, course[0], course)[1]
