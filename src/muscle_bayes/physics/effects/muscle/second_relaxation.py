"""A second, faster or slower relaxation in series with HYST."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpyro import distributions as dist

from muscle_bayes.physics.effect import MemoryEffect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class SecondRelaxation(MemoryEffect):
    """sigma_offset -> sigma_offset + s,   tau ds/dt = c F - s

    s: strain of a Kelvin-Voigt element, its state; F: tension of the series [N]; c: `compliance`, one
    over the element's stiffness [1/N]; tau: `time_constant` [s]. It starts short of its rest under the
    first row's tension by a share `unrested` [-]: a load hangs for some time before its log begins.
    Source: Ferry, Viscoelastic Properties of Polymers (1980), chapter 1, generalised Voigt model.
    """

    name: ClassVar[str] = "second-relaxation"
    port: ClassVar[Port] = "offset"
    dissipative: ClassVar[bool] = False
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "compliance": Parameter(
            unit="1/N",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(0.05 / scales.tension),
            meaning="strain of the second element per tension, at rest",
        ),
        "time_constant": Parameter(
            unit="s",
            off=30.0,
            prior=lambda scales: dist.LogNormal(np.log(30.0), 1.0),
            meaning="time constant of the second element",
        ),
        "unrested": Parameter(
            unit="1",
            off=0.0,
            prior=lambda scales: dist.Beta(1.0, 3.0),
            meaning="share of its rest that it lacks at the first row",
        ),
    }

    compliance: Scalar
    time_constant: Scalar
    unrested: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value + signals.memory[self.name]

    def begun(self, rest: Scalar) -> Scalar:
        return (1.0 - self.unrested) * rest

    def rate(self, signals: Signals) -> Scalar:
        rest = self.compliance * signals.tension
        return (rest - signals.memory[self.name]) / self.time_constant
