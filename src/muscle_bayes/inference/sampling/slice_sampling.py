"""Univariate slice sampling, compiled: for densities with walls, and for those that cost little."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

LogDensity = Callable[[Float[Array, " n"]], tuple[Float[Array, ""], Any]]
"""Log density of a point, up to a constant, and what else was computed there."""


class Located(NamedTuple):
    """A point, its log density, and what else was computed there."""

    point: Float[Array, " n"]
    log_density: Float[Array, ""]
    extra: Any


class _Slice(NamedTuple):
    """The slice along one direction, as far as it is known."""

    level: Float[Array, ""]
    """Log density at the slice's edge."""
    low: Float[Array, ""]
    high: Float[Array, ""]
    """Ends of the interval that is left, in lengths of the direction."""
    looks: Int[Array, ""]


def slice_sweep(
    key: Array,
    log_density: LogDensity,
    point: Float[Array, " n"],
    directions: Float[Array, "step n"],
    most_looks: int = 60,
) -> Located:
    """Transitions along each direction in turn, by shrinkage of an interval placed at random.

    The density is asked for in one place of the program, so that a simulation in it is compiled once.
    It may have walls: -inf and NaN are impossible. Source: R. M. Neal, Slice sampling, Annals of
    Statistics 31 (2003), section 4.1 (an interval that is not stepped out) and figure 5.

    Args:
        key: random key.
        log_density: returns the log density of a point, and anything else that it computed.
        point: the present point, of finite log density.
        directions: along which to move; the length of each is that of its interval, which is best
            somewhat longer than the slice.
        most_looks: most evaluations a direction; a point stays where it is if none lies in the slice.

    Returns:
        The last point.
    """
    dtype, count = point.dtype, len(directions)

    def uniform(key: Array) -> Array:
        return jax.random.uniform(key, dtype=dtype)

    def begin(key: Array, density: Array) -> _Slice:
        key_level, key_place = jax.random.split(key)
        level = density - jax.random.exponential(key_level, dtype=dtype)
        low = -uniform(key_place)
        return _Slice(level, low, low + 1.0, jnp.asarray(0))

    def look(now: tuple[Array, Int[Array, ""], Located, _Slice]) -> Any:
        key, index, here, known = now
        key, key_draw, key_next = jax.random.split(key, 3)
        first = index < 0
        drawn = known.low + (known.high - known.low) * uniform(key_draw)
        position = jnp.where(first, 0.0, drawn)
        there = here.point + position * directions[index]
        moved = Located(there, *log_density(there))
        accepted = first | (moved.log_density > known.level)
        here = jax.tree.map(lambda a, b: jnp.where(accepted, a, b), moved, here)
        shrunk = _Slice(
            known.level,
            jnp.where(position < 0.0, position, known.low),
            jnp.where(position < 0.0, known.high, position),
            known.looks + 1,
        )
        ends = accepted | (shrunk.looks >= most_looks)
        fresh = begin(key_next, here.log_density)
        known = jax.tree.map(lambda a, b: jnp.where(ends, a, b), fresh, shrunk)
        return key, index + ends, here, known

    shapes = jax.eval_shape(log_density, point)
    nothing = jax.tree.map(lambda one: jnp.zeros(one.shape, one.dtype), shapes)
    # The first look is at the present point itself.
    start = key, jnp.asarray(-1), Located(point, *nothing), begin(key, jnp.zeros((), dtype))
    return jax.lax.while_loop(lambda now: now[1] < count, look, start)[2]
