"""What is added to a PI's output for the setpoint's sake."""

from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar


class Feed(eqx.Module):
    """Output that a setpoint [counts] calls for, before any error is seen."""

    @abstractmethod
    def __call__(self, setpoint: Scalar) -> Scalar:
        """Output, in the unit of the PI's."""


class NoFeed(Feed):
    """Nothing."""

    def __call__(self, setpoint: Scalar) -> Scalar:
        return jnp.zeros_like(setpoint)


class TableFeed(Feed):
    """A table over the setpoint, straight between its entries and constant beyond them."""

    setpoint: Float[Array, " entry"]
    """counts, rising"""
    output: Float[Array, " entry"]

    def __call__(self, setpoint: Scalar) -> Scalar:
        return jnp.interp(setpoint, self.setpoint, self.output)
