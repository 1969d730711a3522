"""Rows handed to a compiled program block by block, so that any number of them is one shape."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

BLOCK = 128
"""Rows of a block."""


def in_blocks(
    program: Callable[..., Array], rows: Float[np.ndarray, "row n"], *rest: Any
) -> Float[np.ndarray, "row m"]:
    """`program(rows, *rest)`, which treats every row by itself; the last block is filled up."""
    missing = -len(rows) % BLOCK
    filled = np.concatenate([rows, np.repeat(rows[:1], missing, axis=0)])
    blocks = filled.reshape(-1, BLOCK, filled.shape[-1])
    found = [np.asarray(program(jnp.asarray(block), *rest)) for block in blocks]
    return np.concatenate(found)[: len(rows)]
