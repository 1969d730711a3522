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
from muscle_bayes.inference.walled_moves import WalledOffer

SHARE = 0.8
"""Of the moves of a minimum force that has a ridge, those along it."""
STRIDE = 2.4
"""Standard deviation of the longest moves, in that of the entry."""
NARROW = 0.1
"""Standard deviation, in bent coordinates, up to which a ridge tells anything."""


class Ridge(NamedTuple):
    """How the posterior's mean moves with each walled entry, in bent coordinates."""

    direction: Float[Array, "walled n"]
    """Per unit of the entry; 0 of the noise's and of other walled entries."""
    spread: Float[Array, " walled"]
    """Standard deviation of the entry."""

    @classmethod
    def none(cls, layout: Layout) -> "Ridge":
        """Of the layout's shapes, no ridge."""
        sizes = [part.size for part in blocks(layout)]
        return cls(jnp.zeros((sizes[1], sum(sizes))), jnp.zeros(sizes[1]))


def ridge_of(covariance: Float[np.ndarray, "walled n"], layout: Layout) -> Ridge:
    """From covariances of the walled entries with all."""
    _, outer, noise = blocks(layout)
    variance = covariance[np.arange(outer.size), outer]
    direction = covariance / variance[:, None]
    direction[:, noise] = 0.0
    direction[:, outer] = np.eye(outer.size)
    return Ridge(jnp.asarray(direction), jnp.asarray(np.sqrt(variance)))


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


def offer_along_ridge(
    key: Array,
    which: Array,
    vector: Float[Array, " n"],
    ridge: Ridge,
    bend: Bend,
    layout: Layout,
    data: Data,
) -> WalledOffer:
    """A proposal for the walled entry `which`, symmetric in bent coordinates."""
    key_step, key_reach = jax.random.split(key)
    length = STRIDE * ridge.spread[which] * 10.0 ** (-0.5 * jax.random.uniform(key_reach))
    here = bent(vector, bend, layout, data)
    there = here + length * jax.random.normal(key_step) * ridge.direction[which]
    after, before = (unbent(one, bend, layout, data) for one in (there, here))
    return WalledOffer(after.vector, after.log_volume - before.log_volume)
