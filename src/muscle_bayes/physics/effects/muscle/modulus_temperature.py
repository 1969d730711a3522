"""MODULUS softens when it is hot."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.linkage import Scalar

REFERENCE = 25.0
"""Temperature at which the stiffness is that of Table 2, C."""


class ModulusTemperature(Effect):
    """K -> K exp(-c (T - 25 C))

    K: stiffness of MODULUS, force per unit strain; c: `softening` [1/K]; T: temperature of the
    muscle [C]. Source: Kianzad et al., Nylon coil actuator operating temperature range and stiffness,
    Proc. SPIE 9430 (2015): the modulus of coiled nylon falls steadily between -40 and 200 C.
    """

    name: ClassVar[str] = "modulus-temperature"
    port: ClassVar[Port] = "modulus"
    dissipative: ClassVar[bool] = False
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "softening": Parameter(
            unit="1/K",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(0.01),
            meaning="relative loss of stiffness per kelvin",
        ),
    }

    softening: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return value * jnp.exp(-self.softening * (signals.temperature - REFERENCE))
