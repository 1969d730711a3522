"""How an element's length follows the coordinate q, and with which lever its tension acts."""

from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

Scalar = Float[Array, ""]


class Linkage(eqx.Module):
    """Pin-to-pin length L(q) [m]; a tension F acts on q as the generalised force -F dL/dq."""

    @abstractmethod
    def length(self, q: Scalar) -> Scalar:
        """Length L(q) [m] at coordinate q [rad or m]."""

    @abstractmethod
    def lever(self, q: Scalar) -> Scalar:
        """dL/dq [m/rad or 1]."""


class Pins(Linkage):
    """Rotor pin to stator pin (thesis, eq. 7-10).

        side A: L = sqrt((X - r cos q)^2 + (Y + r sin q)^2),   dL/dq = +r (X sin q + Y cos q) / L
        side B: L = sqrt((X - r cos q)^2 + (Y - r sin q)^2),   dL/dq = +r (X sin q - Y cos q) / L

    `mirror` is +1 on side A, -1 on side B. X, Y, r in m, q in rad.
    """

    radius: float
    anchor_x: float
    anchor_y: float
    mirror: float

    def length(self, q: Scalar) -> Scalar:
        along = self.anchor_x - self.radius * jnp.cos(q)
        across = self.anchor_y + self.mirror * self.radius * jnp.sin(q)
        return jnp.sqrt(along**2 + across**2)

    def lever(self, q: Scalar) -> Scalar:
        swing = self.anchor_x * jnp.sin(q) + self.mirror * self.anchor_y * jnp.cos(q)
        return self.radius * swing / self.length(q)


class Drum(Linkage):
    """Cable on a drum: L = length_at_zero + mirror * drum_radius * q, constant lever. m, rad."""

    length_at_zero: float
    drum_radius: float
    mirror: float

    def length(self, q: Scalar) -> Scalar:
        return self.length_at_zero + self.mirror * self.drum_radius * q

    def lever(self, q: Scalar) -> Scalar:
        return self.mirror * self.drum_radius * jnp.ones_like(q)


class Straight(Linkage):
    """Element along the motion: L = length_at_zero + mirror * q, q in m."""

    length_at_zero: float
    mirror: float

    def length(self, q: Scalar) -> Scalar:
        return self.length_at_zero + self.mirror * q

    def lever(self, q: Scalar) -> Scalar:
        return self.mirror * jnp.ones_like(q)
