"""A motor whose voltage, or duty of PWM, is logged."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpyro import distributions as dist

from muscle_bayes.physics.actuators.actuator import Actuator
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.unknown import UNKNOWN, Unknown


class VoltageDrive(Actuator):
    """Q = gain (u - offset) - back_emf q'

    u: voltage [V] or duty [1]; gain = k/R [N m/V] (of a duty: times the supply, [N m]); back_emf =
    k^2/R [N m s or N s/m]; offset [V or 1]. k: torque constant, R: resistance; its inductance is left
    out. Source: Krause et al., Analysis of Electric Machinery, section 3.3.
    """

    unknowns: ClassVar[Mapping[str, Unknown]] = {
        "gain": Unknown(
            unit="N m/V (N/V) or, per duty, N m (N)",
            prior=lambda size: dist.LogNormal(np.log(size.force / size.signal), 2.0),
            meaning="stall torque (force) per volt or per duty",
        ),
        "offset": Unknown(
            unit="V or 1",
            prior=lambda size: dist.Normal(0.0, 0.1 * size.signal),
            meaning="logged signal at which the motor does not pull",
        ),
        "back_emf": Unknown(
            unit="N m s or N s/m",
            prior=lambda size: dist.HalfNormal(10.0 * size.force / size.speed),
            meaning="torque (force) lost per unit of speed to the motor's own voltage",
        ),
    }

    gain: Scalar | float = UNKNOWN
    offset: Scalar | float = UNKNOWN
    back_emf: Scalar | float = UNKNOWN

    def force(self, signal: Scalar, speed: Scalar) -> Scalar:
        return self.gain * (signal - self.offset) - self.back_emf * speed
