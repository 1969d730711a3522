"""A force or torque sensor whose scale and zero are not trusted."""

from collections.abc import Mapping
from typing import ClassVar

from numpyro import distributions as dist

from muscle_bayes.physics.actuators.actuator import Actuator
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.unknown import UNKNOWN, Unknown


class ScaledForce(Actuator):
    """Q = gain (u - offset), the logged force u [N m or N]

    gain [1]; offset [the force's unit]. Source: calibration line of a force sensor.
    """

    unknowns: ClassVar[Mapping[str, Unknown]] = {
        "gain": Unknown(
            unit="1",
            prior=lambda size: dist.LogNormal(0.0, 1.0),
            meaning="true force per logged force",
        ),
        "offset": Unknown(
            unit="N m or N",
            prior=lambda size: dist.Normal(0.0, 0.1 * size.signal),
            meaning="logged force where there is none",
        ),
    }

    gain: Scalar | float = UNKNOWN
    offset: Scalar | float = UNKNOWN

    def force(self, signal: Scalar, speed: Scalar) -> Scalar:
        return self.gain * (signal - self.offset)
