"""How fast the rotor swings about where it is."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.plant import Drive, Plant


def swing_rate(plant: Plant, q: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
    """sqrt(k / inertia) [rad/s], k = -d force / d q at rest; 0 where nothing restores."""
    still, unit = jnp.zeros_like(q), jnp.ones_like(q)
    slope = jax.jvp(lambda x: plant.force(x, still, hyst, drive), (q,), (unit,))[1]
    inertia = plant.inertia(drive.load)
    square = jnp.maximum(-slope, 0.0) / jnp.where(inertia > 0.0, inertia, 1.0)
    return jnp.where(square > 0.0, jnp.sqrt(jnp.where(square > 0.0, square, 1.0)), 0.0)
