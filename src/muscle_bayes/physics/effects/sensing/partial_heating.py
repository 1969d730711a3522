"""Part of the muscle stays at room temperature, beyond what the metadata say."""

from collections.abc import Mapping
from typing import ClassVar

from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class PartialHeating(Effect):
    """T -> T_room + (1 - u) (T - T_room)

    u: `unheated`, the share of the length in the heater that stays at room temperature [-].
    Source: thesis, eq. 11, with L_heater / L_muscle = 1 - u.
    """

    name: ClassVar[str] = "partial-heating"
    port: ClassVar[Port] = "temperature"
    dissipative: ClassVar[bool] = False
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "unheated": Parameter(
            unit="1",
            off=0.0,
            prior=lambda scales: dist.Beta(1.0, 4.0),
            meaning="share of the muscle at room temperature",
        ),
    }

    unheated: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value - self.unheated * (value - signals.room)
