"""What the controller sees: potentiometer and thermocouples."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar

FULL_SCALE = 1023.0
"""Largest reading of a 10-bit converter."""


class Potentiometer(eqx.Module):
    """reading = round(zero_reading + angle / radians_per_count + noise), read once a period.

    The controller sees the reading of `delay` periods ago. `noise` is a standard deviation [counts].
    """

    radians_per_count: float
    zero_reading: float = 512.0
    noise: float = 0.4
    delay: int = eqx.field(static=True, default=1)

    def counts(self, angle: Scalar) -> Scalar:
        """Reading, not rounded, of an angle [rad]."""
        return self.zero_reading + angle / self.radians_per_count

    def read(self, angle: Scalar, disturbance: Scalar) -> Scalar:
        """Reading of an angle [rad]; `disturbance` is standard normal."""
        counts = jnp.round(self.counts(angle) + self.noise * disturbance)
        return counts.clip(0.0, FULL_SCALE)


class Thermocouples(eqx.Module):
    """lag p' = T - p;  reading = resolution round((p + noise) / resolution), renewed every `every` periods.

    `noise` is a standard deviation [K], `resolution` in K, `lag` in s.
    """

    lag: Scalar | float = 0.0
    resolution: float = 0.1
    noise: float = 0.05
    every: int = eqx.field(static=True, default=13)

    def follow(
        self, probe: Float[Array, "2"], temperature: Float[Array, "2"], duration: float
    ) -> Float[Array, "2"]:
        """Temperatures of the probes [C] after `duration` [s] at `temperature`."""
        share = -jnp.expm1(-duration / jnp.maximum(self.lag, 1e-6))
        return probe + share * (temperature - probe)

    def read(self, temperature: Float[Array, "2"], disturbance: Scalar) -> Float[Array, "2"]:
        """Readings [C]; `disturbance` is standard normal, the same on both channels."""
        noisy = temperature + self.noise * disturbance
        return self.resolution * jnp.round(noisy / self.resolution)
