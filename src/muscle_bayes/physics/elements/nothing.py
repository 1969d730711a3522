"""Nothing on this side."""

import jax.numpy as jnp

from muscle_bayes.physics.effect import Effect
from muscle_bayes.physics.elements.element import Element, Instant
from muscle_bayes.physics.linkage import Scalar


class NoElement(Element):
    """Nothing on this side."""

    def force(self, now: Instant, effects: tuple[Effect, ...]) -> Scalar:
        return jnp.zeros_like(now.q)
