"""The coordinate of HYST's stiffness, which how far HYST creeps bounds, for the sampler alone."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.inference.bend_hyst import STRETCH, Unbent, starts
from muscle_bayes.inference.problem import Data, Layout

STIFFNESS = "stiffness_hyst"
LEAST_LOG_SHARE = -30.0


def _log_share(vector: Array, layout: Layout, data: Data) -> Float[Array, ""]:
    """Log of the greatest shortening of HYST in a first row below its rest, per unit tension."""
    start, runs = starts(layout)[STRETCH], dict(layout.shapes)[STRETCH][0]
    least = jnp.min(vector[start : start + runs])
    return jnp.log(jnp.maximum(-least / data.tension, jnp.exp(LEAST_LOG_SHARE)))


def unbent_stiffness(bent: Float[Array, " n"], layout: Layout, data: Data) -> Unbent:
    """log K from x: log(K a) = -log(1 + exp(-x - log a)), a the shortening per unit tension.

    HYST that begins a record shorter than its rest by more than tension / K would be shorter than
    shut, which is impossible: K a < 1. Far below that bound x is log K.
    """
    at = starts(layout)
    if STRETCH not in at:
        return Unbent(bent, jnp.zeros(()))
    place, log_share = at[STIFFNESS], _log_share(bent, layout, data)
    y = bent[place] + log_share
    vector = bent.at[place].set(jax.nn.log_sigmoid(y) - log_share)
    return Unbent(vector, jax.nn.log_sigmoid(-y))


def bent_stiffness(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, " n"]:
    """Inverse of `unbent_stiffness`; infinite where K is out of bounds."""
    at = starts(layout)
    if STRETCH not in at:
        return vector
    place, log_share = at[STIFFNESS], _log_share(vector, layout, data)
    risen = vector[place] + log_share
    return vector.at[place].set(-jnp.log(jnp.expm1(-risen)) - log_share)
