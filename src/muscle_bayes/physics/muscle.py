"""The coiled-nylon muscle: MODULUS, OFFSET and HYST in series (thesis, Fig. 19, eq. 13-17)."""

import equinox as eqx
import jax.numpy as jnp

from muscle_bayes.physics.linkage import Scalar

DAMPER_FLOOR = 100.0
"""Least damper coefficient, N s/m: eq. 17 falls through zero at T = -T_hyst_offset, a damper cannot."""


class MuscleParameters(eqx.Module):
    """The nine parameters of Table 2, in its units (T in degrees C).

    A [1/K^2], B [1/K], C [-]: thermal offset. F_hyst_min [N], K_hyst [N/m]: HYST's spring.
    F_modulus_min [N], K_modulus [N/m]: MODULUS. H [N s/(m K)], T_hyst_offset [C]: HYST's damper.
    """

    A: Scalar
    B: Scalar
    C: Scalar
    F_hyst_min: Scalar
    K_hyst: Scalar
    F_modulus_min: Scalar
    K_modulus: Scalar
    H: Scalar
    T_hyst_offset: Scalar

    def offset(self, temperature: Scalar) -> Scalar:
        """Thermal strain sigma_offset = A T^2 + B T + C (eq. 16)."""
        return (self.A * temperature + self.B) * temperature + self.C

    def damper(self, temperature: Scalar) -> Scalar:
        """Damper coefficient B_hyst = H (T + T_hyst_offset) [N s/m] (eq. 17), kept positive."""
        return jnp.maximum(self.H * (temperature + self.T_hyst_offset), DAMPER_FLOOR)
