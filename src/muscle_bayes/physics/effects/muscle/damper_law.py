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
    """B -> B exp(-(theta z + kappa z^2) / T_0),  z = 1 - T_0 / T,  T_0 = 298.15 K

    theta: `activation_temperature` [K], fall of the logarithm per 1 / T at T_0; kappa: `curvature` [K];
    T: temperature of the muscle, here in K. With eq. 17 level, kappa = 0 is Arrhenius' law, with theta the
    activation energy over the gas constant; kappa = theta is an exponential of T, up to z^3; the law of
    Williams, Landel and Ferry has kappa < 0: it falls steeply near T_0 and levels off above. Both 0 is
    eq. 17. The priors' widths are factors of three and two between 25 and 90 C.
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
        "curvature": Parameter(
            unit="K",
            off=0.0,
            prior=lambda scales: dist.Normal(0.0, 6000.0),
            meaning="0: Arrhenius; as the activation temperature: exponential; negative: levels off",
        ),
    }

    activation_temperature: Scalar
    curvature: Scalar

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        zero = REFERENCE + KELVIN
        z = 1.0 - zero / (signals.temperature + KELVIN)
        fall = z * (self.activation_temperature + self.curvature * z)
        return value * jnp.exp(-fall / zero)
