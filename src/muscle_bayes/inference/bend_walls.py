"""Coordinates in which the walls of the minimum forces stand still, for the sampler alone."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.inference.bend_hyst import STRETCH, Unbent, starts
from muscle_bayes.inference.blocks import HYST, MODULUS
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.physics.bisection import bisect

NARROW = 1e-3
"""Width, relative to the tension, of the passage between the walls on either side of it."""
LEAST_SHARE = 1e-3
"""Least share of the tension that a wall falls to."""


def _log_lift(vector: Array, layout: Layout, data: Data) -> Float[Array, ""]:
    """log(1 + D / (tension lever)): by how much friction lifts the tension of a muscle that pulls."""
    return jnp.log1p(jnp.exp(vector[starts(layout)["D"]]) / (data.tension * data.lever))


def _log_first(vector: Array, layout: Layout, data: Data) -> Float[Array, ""]:
    """Log of the minimum force at which HYST shuts in a first row, over the tension.

    1 + stiffness_hyst stretch / tension, for the least stretch below 0.
    """
    at, shapes = starts(layout), dict(layout.shapes)
    if STRETCH not in at:
        return jnp.zeros(())
    runs = shapes[STRETCH][0]
    stretch = jnp.minimum(jnp.min(vector[at[STRETCH] : at[STRETCH] + runs]), 0.0)
    stiffness = jnp.exp(vector[at["stiffness_hyst"]])
    return jnp.log(jnp.maximum(1.0 + stiffness * stretch / data.tension, LEAST_SHARE))


def unbent_walls(bent: Float[Array, " n"], layout: Layout, data: Data) -> Unbent:
    """The minimum forces from their distance to walls; the rest of the vector is what it is.

    MODULUS with F_modulus_min above the tension stays shut until friction adds D / lever to it, and
    one below stays open until friction takes that away; HYST with F_hyst_min above the force that
    stretches it in a first row is shut there. A spring that opens or shuts changes all that follows:
    the density falls off a cliff. So log F_modulus_min = log tension + u + log(1 + D / (tension lever))
    tanh(u / narrow), and log F_hyst_min = u + log of that force over the tension.
    """
    at = starts(layout)
    if MODULUS not in at:
        return Unbent(bent, jnp.zeros(()))
    lift, u = _log_lift(bent, layout, data), bent[at[MODULUS]]
    side = jnp.tanh(u / NARROW)
    vector = bent.at[at[MODULUS]].set(jnp.log(data.tension) + u + lift * side)
    vector = vector.at[at[HYST]].add(_log_first(bent, layout, data))
    return Unbent(vector, jnp.log1p(lift * (1.0 - side**2) / NARROW))


def bent_walls(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, " n"]:
    """Inverse of `unbent_walls`."""
    at = starts(layout)
    if MODULUS not in at:
        return vector
    lift, above = _log_lift(vector, layout, data), vector[at[MODULUS]] - jnp.log(data.tension)
    u = bisect(lambda u: above - u - lift * jnp.tanh(u / NARROW), above - lift, above + lift)
    bent = vector.at[at[MODULUS]].set(u)
    return bent.at[at[HYST]].add(-_log_first(vector, layout, data))
