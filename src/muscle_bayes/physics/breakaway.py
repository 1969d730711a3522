"""Dry friction of a rotor in slow motion: what it withstands at rest, and while it moves."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.friction import DryLevels
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.overshoot import LONGEST_SWING
from muscle_bayes.physics.plant import Drive, Plant
from muscle_bayes.physics.slide import Pair, settle
from muscle_bayes.physics.swing import swing_rate

SHORTEST = 1e-3
"""Shortest interval that a move is taken to last, s."""
ONSET = 0.46
"""Loss of friction at twice the pace, over p times twice the pace, from which on a rotor jumps."""
SHARPNESS = 16.0
"""Power of that loss in the odds of a jump."""
JUMP_ITERATIONS = 6
STEEPEST = 0.1
"""Least slope of a jump's balance in Newton's method, as a share of p."""


def dry_levels(
    plant: Plant, q: Scalar, hyst: Pair | Float[Array, "2"], drive: Drive, duration: Scalar
) -> DryLevels:
    """Both levels over the next `duration` [s]; one and the same where no effect corrects dry friction.

    A rotor that follows its equilibrium at the pace x' starts each move from rest and first runs at up
    to 2 x'. Friction that falls with speed, D(v), lets it run away where D(0) - D(2 x') exceeds
    ONSET p 2 x', p = sqrt(k J): from u'' = c - u + 2 u u' at rest, u = q' / x' - 1, with
    D(v) = D(0) - b (v / v_s)^2 and c = x' b / (p v_s^2), whose solutions lose their bound at c = 0.23.
    Below that it glides under D(x'); above, it jumps, and ends where D(0) - D(v) = p (v - x'). x' is
    the pace of a rotor that static friction holds all the way.
    """
    even = DryLevels(plant.friction.dry, plant.friction.dry)
    if not plant.corrects("friction"):
        return even
    # Most models that hold such an effect among others have it off.
    return jax.lax.cond(
        plant.acts_on("friction"),
        lambda: jax.tree.map(jnp.asarray, _uneven_levels(plant, q, hyst, drive, duration)),
        lambda: jax.tree.map(lambda dry: jnp.zeros_like(q) + dry, even),
    )


def _uneven_levels(
    plant: Plant, q: Scalar, hyst: Pair | Float[Array, "2"], drive: Drive, duration: Scalar
) -> DryLevels:
    """The same where effects act on dry friction."""

    def level(speed: Scalar) -> Scalar:
        return plant.dry_friction(q, speed, hyst, drive)

    static = level(jnp.zeros_like(q))
    there = settle(plant, q, hyst, drive, duration, DryLevels(static, static))
    pace = jnp.abs(there - q) / jnp.maximum(duration, SHORTEST)
    rate = jnp.maximum(swing_rate(plant, q, hyst, drive), LONGEST_SWING**-0.5)
    momentum = rate * plant.inertia(drive.load)
    heavy = momentum > 0.0
    momentum = jnp.where(heavy, momentum, 1.0)

    # Friction that falls with speed only beyond what a jump reaches is just higher friction.
    speed = pace + jnp.maximum(static, 0.0) / momentum
    for _ in range(JUMP_ITERATIONS):
        dry, slope = jax.jvp(level, (speed,), (jnp.ones_like(speed),))
        excess = momentum * (speed - pace) - static + dry
        speed = speed - excess / jnp.maximum(momentum + slope, STEEPEST * momentum)
        speed = jnp.maximum(speed, pace)

    needed = ONSET * momentum * 2.0 * pace
    moves = needed > 0.0
    loss = jnp.maximum(static - level(2.0 * pace), 0.0) / jnp.where(moves, needed, 1.0)
    odds = jnp.minimum(loss, 10.0) ** SHARPNESS
    jumps = jnp.where(heavy & moves, odds / (1.0 + odds), 0.0)
    return DryLevels(level(pace) + jumps * (level(speed) - level(pace)), static)
