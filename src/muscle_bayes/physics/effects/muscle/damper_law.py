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
    """B -> B exp(theta ((T_0 / T)^n - 1) / (n T_0)),  T_0 = 298.15 K

    theta: `activation_temperature` [K], slope of the logarithm in 1 / T at T_0; n: `shape` [-]; T:
    temperature of the muscle, here in K. With eq. 17 level, n = 1 is Arrhenius' law, with theta the
    activation energy over the gas constant; n = -1 is an exponential of T; large n falls steeply near T_0
    and levels off above, as the law of Williams, Landel and Ferry does. theta = 0 is eq. 17. The prior's
    width is a factor of three between 25 and 90 C.
    Source: Ferry, Viscoelastic Properties of Polymers (1980), chapter 11.
    """

    name: ClassVar[str] = "damper-law"
    port: ClassVar[Port] = "damper"
    dissipative: ClassVar[bool] = False
    parameters: ClassVar[Mapping[str, Parameter]] = {
        "activation_temperature": Parameter(
            unit="K",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 2000.0),
            meaning="fall of the damper's logarithm with temperature, as an activation temperature at 25 C",
        ),
        "shape": Parameter(
            unit="1",
            off=1.0,
            prior=lambda scales: dist.Normal(1.0, 3.0),
            meaning="1: Arrhenius; -1: exponential; large: as Williams, Landel and Ferry",
        ),
    }

    activation_temperature: Scalar
    shape: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        zero = REFERENCE + KELVIN
        warmer = jnp.log((signals.temperature + KELVIN) / zero)
        still = jnp.abs(self.shape) < 1e-6
        shape = jnp.where(still, 1.0, self.shape)
        change = jnp.where(still, -warmer, jnp.expm1(-shape * warmer) / shape)
        return value * jnp.exp(self.activation_temperature * change / zero)
