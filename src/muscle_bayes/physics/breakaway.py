"""Dry friction of a rotor in slow motion: what it withstands at rest, and while it jumps."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.friction import DryLevels
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.overshoot import LONGEST_SWING
from muscle_bayes.physics.plant import Drive, Plant
from muscle_bayes.physics.swing import swing_rate

JUMP_ITERATIONS = 2


def dry_levels(plant: Plant, q: Scalar, hyst: Float[Array, "2"], drive: Drive) -> DryLevels:
    """Both levels; one and the same where no effect corrects dry friction.

    A rotor of inertia J on stiffness k that breaks away at D(0) and slides under D(v) reaches the
    speed v = (D(0) - D(v)) / sqrt(k J), found by iteration from above. Friction that falls with speed
    only beyond what a jump reaches is just higher friction.
    """
    if not plant.corrects("friction"):
        return DryLevels(plant.friction.dry, plant.friction.dry)
    static = plant.dry_friction(q, jnp.zeros_like(q), hyst, drive)
    rate = jnp.maximum(swing_rate(plant, q, hyst, drive), LONGEST_SWING**-0.5)
    momentum = rate * plant.inertia(drive.load)
    heavy = momentum > 0.0
    sliding = jnp.zeros_like(static)
    for _ in range(JUMP_ITERATIONS + 1):
        speed = jnp.where(heavy, (static - sliding) / jnp.where(heavy, momentum, 1.0), 0.0)
        sliding = plant.dry_friction(q, speed, hyst, drive)
    return DryLevels(sliding, static)
