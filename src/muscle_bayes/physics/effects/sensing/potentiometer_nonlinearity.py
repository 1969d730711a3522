"""The angle sensor has another gain than stated, and bends."""

from collections.abc import Mapping
from typing import ClassVar

from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class PotentiometerNonlinearity(Effect):
    """shown = q + g q + b q^2

    g: `gain` error [-]; b: `bend` [1/rad, or 1/m where motion is linear].
    Source: gain error and nonlinearity of a sensor, e.g. Fraden, Handbook of Modern Sensors, chapter 2.
    """

    name: ClassVar[str] = "potentiometer-nonlinearity"
    port: ClassVar[Port] = "reading"
    dissipative: ClassVar[bool] = False
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "gain": Parameter(
            unit="1",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 0.03),
            meaning="relative error of the sensor's gain",
        ),
        "bend": Parameter(
            unit="1/rad or 1/m",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 0.03 / scales.range),
            meaning="curvature of the reading",
        ),
    }

    gain: Scalar
    bend: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value + (self.gain + self.bend * value) * value
