"""Rounding to integers whose derivative is that of what is rounded (straight-through)."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def rounded(value: Float[Array, "..."]) -> Float[Array, "..."]:
    """The nearest integer; derivative 1, a stated surrogate for the true 0 (Bengio et al. 2013)."""
    return value + jax.lax.stop_gradient(jnp.round(value) - value)


def truncated(value: Float[Array, "..."]) -> Float[Array, "..."]:
    """The integer nearest on the way to zero, as C divides; derivative 1 as in `rounded`."""
    return value + jax.lax.stop_gradient(jnp.trunc(value) - value)
