"""Univariate slice sampling, compiled: for densities with walls, and for those that cost little."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

LogDensity = Callable[[Float[Array, " n"]], tuple[Float[Array, ""], Any]]
"""Log density of a point, up to a constant, and what else was computed there."""

DOWN, UP, SHRINK = range(3)
"""Stages: stepping out to either side, shrinkage."""


class Located(NamedTuple):
    """A point, its log density, and what else was computed there."""

    point: Float[Array, " n"]
    log_density: Float[Array, ""]
    extra: Any


class _Search(NamedTuple):
    """The slice along one direction, as far as it is known."""

    stage: Int[Array, ""]
    level: Float[Array, ""]
    """Log density at the slice's edge."""
    position: Float[Array, ""]
    """Along the direction, where the density is asked for next."""
    low: Float[Array, ""]
    high: Float[Array, ""]
    steps: Float[Array, "2"]
    """Steps out that are left to either side."""
    looks: Int[Array, ""]


def slice_sweep(
    key: Array,
    log_density: LogDensity,
    point: Float[Array, " n"],
    directions: Float[Array, "step n"],
    most_steps: int = 8,
    most_looks: int = 60,
) -> Located:
    """Transitions along each direction in turn, by stepping out and shrinkage.

    The density is asked for in one place of the program, so that a simulation in it is compiled once.
    It may have walls: -inf and NaN are impossible. Source: R. M. Neal, Slice sampling, Annals of
    Statistics 31 (2003), figures 3 and 5.

    Args:
        key: random key.
        log_density: returns the log density of a point, and anything else that it computed.
        point: the present point, of finite log density.
        directions: along which to move; the length of each is that of its first interval.
        most_steps: most intervals by which a slice is stepped out, both sides together.
        most_looks: most evaluations a direction; a point stays where it is if none lies in the slice.

    Returns:
        The last point.
    """
    dtype, count = point.dtype, len(directions)

    def uniform(key: Array) -> Array:
        return jax.random.uniform(key, dtype=dtype)

    def begin(key: Array, here: Located) -> _Search:
        key_level, key_place, key_share = jax.random.split(key, 3)
        level = here.log_density - jax.random.exponential(key_level, dtype=dtype)
        low, down = -uniform(key_place), jnp.floor(most_steps * uniform(key_share))
        steps = jnp.stack([down, most_steps - 1.0 - down])
        return _Search(jnp.asarray(DOWN), level, low, low, low + 1.0, steps, jnp.asarray(0))

    def look(now: tuple[Array, Int[Array, ""], Located, _Search]) -> Any:
        key, index, here, search = now
        key, key_draw, key_next = jax.random.split(key, 3)
        there = here.point + search.position * directions[index]
        moved = Located(there, *log_density(there))
        search = _looked(search, moved.log_density > search.level, uniform(key_draw))
        accepted = search.stage > SHRINK
        ends = accepted | (search.looks >= most_looks)
        here = jax.tree.map(lambda a, b: jnp.where(accepted, a, b), moved, here)
        search = jax.tree.map(lambda a, b: jnp.where(ends, a, b), begin(key_next, here), search)
        return key, index + ends, here, search

    shapes = jax.eval_shape(log_density, point)
    nothing = jax.tree.map(lambda one: jnp.zeros(one.shape, one.dtype), shapes)
    zero = jnp.zeros((), dtype)
    # The first look is at the present point itself, and is accepted.
    search = _Search(
        jnp.asarray(SHRINK), -jnp.inf + zero, zero, zero, zero, jnp.zeros(2, dtype), jnp.asarray(0)
    )
    start = key, jnp.asarray(-1), Located(point, *nothing), search
    return jax.lax.while_loop(lambda now: now[1] < count, look, start)[2]


def _looked(search: _Search, inside: Array, share: Array) -> _Search:
    """What a look tells: whether the density there was above the level. A stage past SHRINK: accepted."""
    stage, at = search.stage, search.position
    upward = stage == UP
    out, shrinking = (stage == DOWN) | upward, stage == SHRINK
    side = jnp.where(upward, 1, 0)
    further = out & inside & (search.steps[side] > 0.0)
    end = at + jnp.where(further, jnp.where(upward, 1.0, -1.0), 0.0)
    below = at < 0.0
    low = jnp.where(stage == DOWN, end, jnp.where(shrinking & below, at, search.low))
    high = jnp.where(upward, end, jnp.where(shrinking & ~below, at, search.high))
    next_stage = stage + ((out & ~further) | (shrinking & inside))
    drawn = jnp.where(next_stage == UP, high, low + (high - low) * share)
    return _Search(
        next_stage,
        search.level,
        jnp.where(further, end, drawn),
        low,
        high,
        search.steps.at[side].add(jnp.where(further, -1.0, 0.0)),
        search.looks + 1,
    )
