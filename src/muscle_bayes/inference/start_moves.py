"""Metropolis moves of a run's start across an edge of its dead band.

Where the posterior has both sides, trajectories cross seldom: readings tell a start inside to a small part
of what its prior leaves beyond the edge.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from muscle_bayes.inference.bend_hyst import starts
from muscle_bayes.inference.dead_bands import START
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.proposed_move import ProposedMove
from muscle_bayes.inference.squeeze import Squeeze


def _told(squeeze: Squeeze) -> Bool[Array, " edge"]:
    """Which edges the posterior has."""
    return jnp.any(squeeze.slope != 0.0, axis=1)


def has_edges(squeeze: Squeeze) -> Bool[Array, ""]:
    """Whether any start lies at an edge."""
    return jnp.any(_told(squeeze))


def offer_start(
    key: Array, vector: Float[Array, " n"], squeeze: Squeeze, layout: Layout, data: Data
) -> ProposedMove:
    """The unconstrained vector with a start at one of the edges drawn anew from its prior.

    An independence sampler: the prior's density s' over s, p(s) / p(s'), is the odds of the way back.
    """
    key_edge, key_start = jax.random.split(key)
    edge = jax.random.categorical(key_edge, jnp.where(_told(squeeze), 0.0, -jnp.inf))
    entry = jnp.argmax(jnp.abs(squeeze.direction[edge]))
    run = entry - starts(layout)[START]
    prior = data.priors[START]
    middle, scale = (
        jnp.broadcast_to(one, prior.batch_shape)[run] for one in (prior.loc, prior.scale)
    )
    normal = jax.random.normal(key_start)
    before = (vector[entry] - middle) / scale
    return ProposedMove(
        vector.at[entry].set(middle + scale * normal), 0.5 * (normal**2 - before**2)
    )
