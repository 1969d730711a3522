"""The coordinate of HYST's stiffness where it is bounded by how far HYST creeps, for the sampler alone."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.bend_hyst import STRETCH, Unbent, starts
from muscle_bayes.inference.bisection import increasing_root
from muscle_bayes.inference.problem import Data, Layout

STIFFNESS = "stiffness_hyst"
PASSAGE = 5.0
"""Where on the coordinate HYST shuts in a first row."""
LEAST_LOG_SHARE = -30.0


def _log_share(vector: Array, layout: Layout, data: Data) -> Float[Array, ""]:
    """Log of the greatest shortening of HYST in a first row below its rest, per unit tension."""
    start, runs = starts(layout)[STRETCH], dict(layout.shapes)[STRETCH][0]
    least = jnp.min(vector[start : start + runs])
    return jnp.log(jnp.maximum(-least / data.tension, jnp.exp(LEAST_LOG_SHARE)))


def _rise(y: Array) -> Float[Array, ""]:
    """-log(1 + exp(-y)) + log(1 + exp(y - passage)): y far below 0, below 0 up to the passage."""
    return -jax.nn.softplus(-y) + jax.nn.softplus(y - PASSAGE)


def stays_open(vectors: Float[Array, "draw n"], layout: Layout, data: Data) -> Float[Array, ""]:
    """1 where stiffness times shortening is below the tension in every draw, else 0."""
    at = starts(layout)
    if STRETCH not in at:
        return jnp.zeros(())
    share = jax.vmap(lambda vector: _log_share(vector, layout, data))(vectors)
    return jnp.where(jnp.all(vectors[:, at[STIFFNESS]] + share < 0.0), 1.0, 0.0)


def unbent_stiffness(
    bent: Float[Array, " n"], opened: Float[Array, ""], layout: Layout, data: Data
) -> Unbent:
    """log K from x where `opened` is 1: log(K a) = f(x + log a), with a the shortening per tension.

    HYST that begins a record shorter than its rest by more than tension / K is shut there, and the
    record would look another way: a cliff that bounds K. f(y) = -log(1 + exp(-y)) + log(1 + exp(y - 5))
    is y far from the cliff and comes to it slowly; beyond, it goes on, so that nothing is out of
    reach.
    """
    at = starts(layout)
    if STRETCH not in at:
        return Unbent(bent, jnp.zeros(()))
    place, log_share = at[STIFFNESS], _log_share(bent, layout, data)
    y = bent[place] + log_share
    vector = bent.at[place].set(jnp.where(opened > 0.0, _rise(y) - log_share, bent[place]))
    slope = jax.nn.sigmoid(-y) + jax.nn.sigmoid(y - PASSAGE)
    return Unbent(vector, jnp.where(opened > 0.0, jnp.log(slope), 0.0))


def bent_stiffness(
    vector: Float[Array, " n"], opened: Float[Array, ""], layout: Layout, data: Data
) -> Float[Array, " n"]:
    """Inverse of `unbent_stiffness`."""
    at = starts(layout)
    if STRETCH not in at:
        return vector
    place, log_share = at[STIFFNESS], _log_share(vector, layout, data)
    risen = vector[place] + log_share
    # f(y) is at most y and at least y - 5 beyond 0.
    low, high = risen - np.log(4.0), jnp.maximum(risen, 0.0) + PASSAGE + 1.0
    x = increasing_root(_rise, risen, low, high) - log_share
    return vector.at[place].set(jnp.where(opened > 0.0, x, vector[place]))
