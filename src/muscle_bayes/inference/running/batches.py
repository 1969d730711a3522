"""Many simulations at once, as many as the device does well side by side."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from muscle_bayes.inference.model.problem import Layout
from muscle_bayes.inference.running.side_by_side import side_by_side

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


def of_rows(
    program: Callable[..., Any], rows: Sequence[tuple], layout: Layout, workers: int = 1
) -> list[Any]:
    """`program(*row[:-1], layout, row[-1])` of every row; the last of a row is its data.

    On a CPU, `workers` rows at a time: one fills its vector units, and a batch of them takes as long as
    they do one by one. Elsewhere all side by side, in batches of a power of two: few are compiled.
    """
    if jax.default_backend() == "cpu" or len(rows) < 2:
        return list(side_by_side(lambda row: program(*row[:-1], layout, row[-1]), rows, workers))
    size = 1 << (len(rows) - 1).bit_length()
    padded = [*rows, *[rows[-1]] * (size - len(rows))]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *padded)
    found = jax.device_get(_batched(program, layout)(stacked))
    return [jax.tree.map(lambda leaf, i=i: leaf[i], found) for i in range(len(rows))]


@lru_cache(maxsize=64)
def _batched(program: Callable[..., Any], layout: Layout) -> Callable[[tuple], Any]:
    return jax.jit(jax.vmap(lambda row: program(*row[:-1], layout, row[-1])))
