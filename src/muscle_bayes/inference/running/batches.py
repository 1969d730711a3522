"""Many simulations at once, as many as the device does well side by side."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

SIDE_BY_SIDE = {"cpu": 4}
"""Simulations per batch: a CPU core fills its vector units with these, more only fill its caches."""
ON_ACCELERATORS = 512


def in_batches(function: Callable[[Any], Any], arguments: Any) -> Any:
    """`function` of every entry along the leading axis of `arguments`, batch after batch by `vmap`."""
    size = SIDE_BY_SIDE.get(jax.default_backend(), ON_ACCELERATORS)
    return jax.lax.map(function, arguments, batch_size=size)


def of_draws(program: Callable[..., Any], vectors: Any, *rest: Any) -> Any:
    """`program(vector, *rest)` of every vector, stacked.

    One after the other on a CPU, for `program` is compiled already; side by side elsewhere.
    """
    if jax.default_backend() == "cpu":
        # Not by jnp.stack, nor over a JAX array: both compile something of hundreds of arguments.
        found = [program(vector, *rest) for vector in np.asarray(vectors)]
        return jax.tree.map(lambda *all_: jnp.asarray(np.stack(all_)), *found)
    return jax.jit(lambda vectors: in_batches(lambda v: program(v, *rest), vectors))(vectors)
