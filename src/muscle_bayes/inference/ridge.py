"""Metropolis moves along the posterior's ridges: of a minimum force with all that it is told together with.

A force may be known to a thousandth, and given the rest, as sensors' zeros, to a tenth of that: moves of it
alone go nowhere.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from muscle_bayes.inference.bend import Bend, bent, unbent
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.proposed_move import ProposedMove

SHARE = 0.8
"""Of the moves of a minimum force that has a ridge, those along it."""
STRIDE = 2.4
"""Standard deviation of the longest steps, in that of the entry."""
ANEW = 0.5
"""Share of moves along a ridge that are draws; the others are steps."""
WIDER = 1.2
"""Standard deviation of what is drawn, in that of the entry: its tails may be heavier."""
LEAST_FRESH = 0.2
"""Least share of a draw, in standard deviations, that does not depend on where the entry was."""
NARROW = 0.1
"""Standard deviation, in bent coordinates, up to which a ridge tells anything."""


class Ridge(NamedTuple):
    """How the posterior's mean moves with each walled entry, in bent coordinates."""

    direction: Float[Array, "walled n"]
    """Per unit of the entry; 0 of the noise's and of other walled entries."""
    middle: Float[Array, " walled"]
    """Mean of the entry."""
    spread: Float[Array, " walled"]
    """Its standard deviation."""

    @classmethod
    def none(cls, layout: Layout) -> "Ridge":
        """Of the layout's shapes, no ridge."""
        sizes = [part.size for part in blocks(layout)]
        nothing = jnp.zeros(sizes[1])
        return cls(jnp.zeros((sizes[1], sum(sizes))), nothing, nothing)


def ridge_of(
    middle: Float[np.ndarray, " walled"], covariance: Float[np.ndarray, "walled n"], layout: Layout
) -> Ridge:
    """From means of the walled entries, and their covariances with all."""
    _, outer, noise = blocks(layout)
    variance = covariance[np.arange(outer.size), outer]
    direction = covariance / variance[:, None]
    direction[:, noise] = 0.0
    direction[:, outer] = np.eye(outer.size)
    spread = np.sqrt(variance)
    return Ridge(*(jnp.asarray(part) for part in (direction, middle, spread)))


def scattered(
    points: Float[np.ndarray, "point n"], ridge: Ridge, rng: np.random.Generator
) -> Float[np.ndarray, "point n"]:
    """Bent points, each moved along every ridge by a normal draw of its spread."""
    spread = np.asarray(ridge.spread * has_ridge(ridge))
    steps = rng.standard_normal((len(points), spread.size)) * spread
    return points + steps @ np.asarray(ridge.direction)


def has_ridge(ridge: Ridge) -> Bool[Array, " walled"]:
    """Which entries are told, and so worth moving with others."""
    return (ridge.spread > 0.0) & (ridge.spread < NARROW)


class _Move(NamedTuple):
    """Of an entry."""

    length: Float[Array, ""]
    log_odds: Float[Array, ""]
    """Log density of the way back over that of the way there."""


def _stepped(key: Array, spread: Float[Array, ""]) -> _Move:
    """A step, long or short, symmetric."""
    key_step, key_reach = jax.random.split(key)
    length = STRIDE * spread * 10.0 ** (-0.5 * jax.random.uniform(key_reach))
    return _Move(length * jax.random.normal(key_step), jnp.zeros(()))


def _drawn(key: Array, above: Float[Array, ""], spread: Float[Array, ""]) -> _Move:
    """From x above the middle to sqrt(1 - b^2) x + b s n, n standard normal.

    That leaves normal entries with standard deviation s as they are (autoregressive, or
    preconditioned Crank-Nicolson: Cotter, Roberts, Stuart and White, Statistical Science 28, 2013).
    """
    key_share, key_fresh = jax.random.split(key)
    wide = jnp.where(spread > 0.0, WIDER * spread, 1.0)
    fresh = jax.random.uniform(key_share, minval=LEAST_FRESH)
    there = jnp.sqrt(1.0 - fresh**2) * above + fresh * wide * jax.random.normal(key_fresh)
    return _Move(there - above, 0.5 * (there**2 - above**2) / wide**2)


def offer_along_ridge(
    key: Array,
    which: Array,
    vector: Float[Array, " n"],
    ridge: Ridge,
    bend: Bend,
    layout: Layout,
    data: Data,
) -> ProposedMove:
    """A proposal for the walled entry `which`, a step or a draw, with all that moves with it."""
    key_kind, key_step, key_draw = jax.random.split(key, 3)
    here = bent(vector, bend, layout, data)
    above = here[jnp.asarray(blocks(layout).walled)[which]] - ridge.middle[which]
    step, draw = (
        _stepped(key_step, ridge.spread[which]),
        _drawn(key_draw, above, ridge.spread[which]),
    )
    anew = jax.random.uniform(key_kind) < ANEW
    length, log_odds = (jnp.where(anew, a, b) for a, b in zip(draw, step, strict=True))
    there = here + length * ridge.direction[which]
    after, before = (unbent(one, bend, layout, data) for one in (there, here))
    return ProposedMove(after.vector, after.log_volume - before.log_volume + log_odds)
