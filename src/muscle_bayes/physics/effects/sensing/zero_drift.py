"""The sensor's zero drifts, as it warms or as the humidity changes."""

from collections.abc import Mapping
from typing import ClassVar

from jaxtyping import Array, Float
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Parameter, ReadingFilter
from muscle_bayes.physics.linkage import Scalar


class ZeroDrift(ReadingFilter):
    """shown(t) = q(t) + r t

    t: time since the run's first row [s]; r: `rate`, the same in all runs [rad/s, or m/s where motion is
    linear].
    Source: zero drift to first order in time, e.g. Fraden, Handbook of Modern Sensors, chapter 2.
    """

    name: ClassVar[str] = "zero-drift"
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "rate": Parameter(
            unit="rad/s or m/s",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 0.1 * scales.range / scales.duration),
            meaning="rate at which the reading of a coordinate at rest rises",
        ),
    }

    rate: Scalar

    def __call__(
        self, time: Float[Array, " instant"], course: Float[Array, " instant"]
    ) -> Float[Array, " instant"]:
        return course + self.rate * (time - time[0])
