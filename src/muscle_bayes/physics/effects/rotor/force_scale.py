"""What drives the rig is stronger or weaker than stated: a wrong mass, lever or torque constant."""

from collections.abc import Mapping
from typing import ClassVar

from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class ForceScale(Effect):
    """Q -> Q + s (m g R_d + F)

    s: `error`, relative, of what is known of load and drive [-]; m g R_d and F: generalised forces of the
    load and of what drives the rotor [N m or N]. An arm or a spring that is stated wrong by a factor is
    the same, but for the unit of inertia and friction.
    Source: calibration error of a scale, e.g. Fraden, Handbook of Modern Sensors, chapter 2.
    """

    name: ClassVar[str] = "force-scale"
    port: ClassVar[Port] = "torque"
    dissipative: ClassVar[bool] = False
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "error": Parameter(
            unit="1",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 0.1),
            meaning="relative error of the load and of what drives the rotor",
        ),
    }

    error: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value + self.error * signals.driving
