"""Many simulations at once, as many as the device does well side by side."""

from collections.abc import Callable
from typing import Any

import jax

SIDE_BY_SIDE = {"cpu": 4}
"""Simulations per batch: a CPU core fills its vector units with these, more only fill its caches."""
ON_ACCELERATORS = 512


def in_batches(function: Callable[[Any], Any], arguments: Any) -> Any:
    """`function` of every entry along the leading axis of `arguments`, batch after batch by `vmap`."""
    size = SIDE_BY_SIDE.get(jax.default_backend(), ON_ACCELERATORS)
    return jax.lax.map(function, arguments, batch_size=size)
