"""A constant generalised force that nobody logged."""

from collections.abc import Mapping
from typing import ClassVar

from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class BiasTorque(Effect):
    """Q -> Q + Q_0

    Q_0: `torque` [N m, or N where motion is linear], positive in the direction of q.
    Source: the offset term of dynamic identification models, e.g. Janot, Gautier and Brunot (2019).
    """

    name: ClassVar[str] = "bias-torque"
    port: ClassVar[Port] = "torque"
    dissipative: ClassVar[bool] = False
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "torque": Parameter(
            unit="N m or N",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 0.3 * scales.force),
            meaning="constant applied generalised force",
        )
    }

    torque: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value + self.torque
