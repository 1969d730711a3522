"""Where a rotor without inertia comes to rest within an interval."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.equilibrium import play
from muscle_bayes.physics.friction import DryLevels
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.plant import Drive, Plant

Pair = tuple[Scalar, Scalar]
"""sigma_hyst of sides A and B. Scalars, not an array: that compiles to a third of the work."""


def force_over(x: Scalar, args: tuple) -> Scalar:
    """Force at x; effects that depend on speed see the mean speed of the move from the origin."""
    plant, origin, hyst, drive, duration = args
    speed = jnp.where(duration > 0.0, (x - origin) / jnp.where(duration > 0, duration, 1.0), 0.0)
    return plant.force(x, speed, hyst, drive)


def settle(
    plant: Plant,
    q: Scalar,
    hyst: Pair | Float[Array, "2"],
    drive: Drive,
    duration: Scalar,
    levels: DryLevels,
) -> Scalar:
    """Slide to equilibrium within `duration` [s] against dry friction of these levels."""
    return play(force_over, q, (plant, q, hyst, drive, duration), levels, plant.stops)
