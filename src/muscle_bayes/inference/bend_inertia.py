"""The coordinate of the rotor's inertia, for the sampler alone."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.inference.bend_hyst import Unbent, starts
from muscle_bayes.inference.log_softplus import log_softplus, log_softplus_slope, softplus_inverse
from muscle_bayes.inference.problem import Layout

INERTIA = "J"


def place_of_inertia(layout: Layout) -> int:
    """Index of log J in the unconstrained vector."""
    return starts(layout)[INERTIA]


def error_of_draws(vectors: Float[Array, "draw n"], layout: Layout) -> Float[Array, ""]:
    """Standard deviation of J over unconstrained vectors."""
    return jnp.exp(vectors[:, place_of_inertia(layout)]).std()


def unbent_inertia(bent: Float[Array, " n"], error: Float[Array, ""], layout: Layout) -> Unbent:
    """log J from x, J = error log(1 + exp(x)).

    In slow runs inertia shows as the rotor's overshoot, in proportion to J: the density is nearly
    normal in J, so that in log J it falls ever more steeply above, and hardly at all below some size.
    """
    place = place_of_inertia(layout)
    x = bent[place]
    vector = bent.at[place].set(jnp.log(error) + log_softplus(x))
    return Unbent(vector, log_softplus_slope(x))


def bent_inertia(
    vector: Float[Array, " n"], error: Float[Array, ""], layout: Layout
) -> Float[Array, " n"]:
    """Inverse of `unbent_inertia`."""
    place = place_of_inertia(layout)
    return vector.at[place].set(softplus_inverse(vector[place] - jnp.log(error)))
