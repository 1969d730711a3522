"""Springs that pull but never push."""

import jax.numpy as jnp

from muscle_bayes.conventions import (
    SPRING_INTERCEPT,
    SPRING_MIN_LENGTH,
    SPRING_RATE,
    STRAIN_EPSILON,
)
from muscle_bayes.physics.linkage import Scalar


def tensile_spring(
    strain: Scalar, stiffness: Scalar, minimum_force: Scalar, eps: float = STRAIN_EPSILON
) -> Scalar:
    """Tension [N] of a spring that needs a minimum force to open (thesis, eq. 13 and 14).

        F = stiffness (strain - eps) + minimum_force    strain > eps
            minimum_force strain / eps                  0 < strain <= eps
            0                                           strain <= 0

    `stiffness` is L_base K [N per unit strain].
    """
    opening = minimum_force / eps * jnp.clip(strain, 0.0, eps)
    return opening + stiffness * jnp.maximum(strain - eps, 0.0)


def lost_stretch(stretch: Scalar, span: Scalar) -> Scalar:
    """Stretch that is lost while parts go taut, evenly over stretches from 0 to `span`.

        lost = c (1 - c / (2 span)),   c = min(max(stretch, 0), span)

    What is left pulls: 0 below 0, stretch^2 / (2 span) up to span, stretch - span / 2 beyond.
    """
    covered = jnp.where(stretch > 0.0, jnp.minimum(stretch, span), 0.0)
    share = jnp.where(span > 0.0, covered / jnp.where(span > 0.0, span, 1.0), 1.0)
    return covered * (1.0 - 0.5 * share)


def tensile_strain(
    force: Scalar, stiffness: Scalar, minimum_force: Scalar, eps: float = STRAIN_EPSILON
) -> Scalar:
    """Strain at which `tensile_spring` pulls with `force` [N]; 0 where that is not positive."""
    opening = eps * jnp.clip(force / minimum_force, 0.0, 1.0)
    return opening + jnp.maximum(force - minimum_force, 0.0) / stiffness


def reference_spring(length: Scalar) -> Scalar:
    """Tension [N] of the reference spring at pin-to-pin `length` [m] (thesis, eq. 12).

    F = 145.71 x - 5.2097 for x >= 0.04682 m. Its coils touch there; below, it goes slack over the
    same small strain as the other springs.
    """
    closed = SPRING_RATE * SPRING_MIN_LENGTH + SPRING_INTERCEPT
    slack = STRAIN_EPSILON * SPRING_MIN_LENGTH
    opening = closed * jnp.clip((length - SPRING_MIN_LENGTH) / slack + 1.0, 0.0, 1.0)
    return opening + SPRING_RATE * jnp.maximum(length - SPRING_MIN_LENGTH, 0.0)
