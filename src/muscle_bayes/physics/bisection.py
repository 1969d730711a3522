"""Vectorised bisection."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

HALVINGS = 50
"""Enough for the last bit of a double."""


def bisect(
    falls: Callable[[Array], Array],
    low: Float[Array, "*n"],
    high: Float[Array, "*n"],
    halvings: int = HALVINGS,
) -> Float[Array, "*n"]:
    """Root of each decreasing function `falls`, positive at low and negative at high; no derivative."""

    def halve(_: int, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        low, high = ends
        middle = 0.5 * (low + high)
        above = falls(middle) > 0.0
        return jnp.where(above, middle, low), jnp.where(above, high, middle)

    low, high = jax.lax.fori_loop(0, halvings, halve, (low, high))
    return 0.5 * (low + high)
