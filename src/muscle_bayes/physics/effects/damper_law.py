"""HYST's damper follows another law of temperature than eq. 17."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar

KELVIN, REFERENCE = 273.15, 25.0
"""Zero of the Celsius scale [K]; temperature at which eq. 17 is kept [C]."""


class DamperLaw(Effect):
    """B -> B exp(theta (1 / T - 1 / 298.15 K))

    theta: `activation_temperature`, activation energy over the gas constant [K]; T: temperature of the
    muscle, here in K. With eq. 17 level (H T small against H T_hyst_offset) this is Arrhenius' law; with
    theta = 0 it is eq. 17. The prior's width is a factor of three between 25 and 90 C.
    Source: Ferry, Viscoelastic Properties of Polymers (1980), chapter 11, Arrhenius' shift of times.
    """

    name: ClassVar[str] = "damper-law"
    port: ClassVar[Port] = "damper"
    dissipative: ClassVar[bool] = False
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "activation_temperature": Parameter(
            unit="K",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 2000.0),
            meaning="activation energy over the gas constant",
        ),
    }

    activation_temperature: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        inverse = 1.0 / (signals.temperature + KELVIN) - 1.0 / (REFERENCE + KELVIN)
        return value * jnp.exp(self.activation_temperature * inverse)
