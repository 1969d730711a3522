"""A motor whose current is logged."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpyro import distributions as dist

from muscle_bayes.physics.actuators.actuator import Actuator
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.unknown import UNKNOWN, Unknown


class CurrentDrive(Actuator):
    """Q = gain (i - offset)

    i [A]: current; gain [N m/A or N/A]: torque (force) constant; offset [A]: zero of the current sensor.
    Source: Krause et al., Analysis of Electric Machinery, section 3.3.
    """

    unknowns: ClassVar[Mapping[str, Unknown]] = {
        "gain": Unknown(
            unit="N m/A or N/A",
            prior=lambda size: dist.LogNormal(np.log(size.force / size.signal), 2.0),
            meaning="torque (force) constant of the motor",
        ),
        "offset": Unknown(
            unit="A",
            prior=lambda size: dist.Normal(0.0, 0.1 * size.signal),
            meaning="logged current where there is none",
        ),
    }

    gain: Scalar | float = UNKNOWN
    offset: Scalar | float = UNKNOWN

    def force(self, signal: Scalar, speed: Scalar) -> Scalar:
        return self.gain * (signal - self.offset)
