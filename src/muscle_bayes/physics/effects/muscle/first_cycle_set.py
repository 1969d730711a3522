"""Training that does not return: the muscle lengthens when it is hot and taut, and stays so."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from numpyro import distributions as dist

from muscle_bayes.physics.effect import MemoryEffect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar


class FirstCycleSet(MemoryEffect):
    """sigma_offset -> sigma_offset + s - s_0,   tau ds/dt = max(g F max(T - T_room, 0) - s, 0)

    s: strain that stays, its state, which never falls; F: tension of the series [N]; T: temperature of
    the muscle [C]; g: `gain` [1/(N K)]; tau: `time_constant` [s]; s_0: what training before the first row
    has `trained` [-]. Source: thesis, observations of training: the first heating trains most, and
    more load and heat train further.
    """

    name: ClassVar[str] = "first-cycle-set"
    port: ClassVar[Port] = "offset"
    dissipative: ClassVar[bool] = False
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "gain": Parameter(
            unit="1/(N K)",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(1e-3 / scales.tension),
            meaning="strain that stays, per tension and kelvin above the room",
        ),
        "time_constant": Parameter(
            unit="s",
            off=30.0,
            prior=lambda scales: dist.LogNormal(np.log(30.0), 1.0),
            meaning="time in which it is gained",
        ),
        "trained": Parameter(
            unit="1",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(0.03),
            meaning="strain that training before the first row has left",
        ),
    }

    gain: Scalar
    time_constant: Scalar
    trained: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value + signals.memory[self.name] - self.trained

    def rate(self, signals: Signals) -> Scalar:
        heat = jnp.maximum(signals.temperature - signals.room, 0.0)
        missing = self.gain * signals.tension * heat - signals.memory[self.name]
        # So written, and not as a maximum, the derivative at gain 0 is that of growth.
        return jnp.where(missing >= 0.0, missing, 0.0) / self.time_constant

    def initial(self) -> Scalar:
        return jnp.asarray(self.trained)
