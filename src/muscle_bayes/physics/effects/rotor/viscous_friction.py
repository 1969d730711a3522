"""Friction proportional to speed."""

from collections.abc import Mapping
from typing import ClassVar

from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class ViscousFriction(Effect):
    """Q -> Q - c q'

    c: `coefficient` [N m s, or N s/m where motion is linear].
    Source: Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994), section 2.
    """

    name: ClassVar[str] = "viscous-friction"
    port: ClassVar[Port] = "torque"
    dissipative: ClassVar[bool] = True
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "coefficient": Parameter(
            unit="N m s or N s/m",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(scales.force / scales.speed),
            meaning="generalised force per unit speed",
        )
    }

    coefficient: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value - self.coefficient * signals.speed
