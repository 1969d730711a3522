"""Coordinates of positive sizes in which readings are nearly linear, for the sampler alone."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.bend_hyst import BEND, CONTRACTION, Unbent, starts
from muscle_bayes.inference.log_softplus import log_softplus, log_softplus_slope, softplus_inverse
from muscle_bayes.inference.problem import Layout

POWERS = {"J": 1.0, CONTRACTION: 1.0, "modulus": -1.0, "stiffness_hyst": -1.0}
"""Power of each parameter to which readings are nearly linear: the rotor overshoots in proportion to
J, a muscle shortens by its contraction and lengthens by tension over stiffness."""
KNOWN = 0.3
"""Standard deviation of the logarithm of the contraction up to which it is taken for known."""


class Sizes(NamedTuple):
    """What fixes the coordinates."""

    error: Float[Array, " size"]
    """Standard deviation of each size, a power of a parameter."""
    contraction: Float[Array, ""]
    """Its typical logarithm."""
    known: Float[Array, ""]
    """1 where the contraction is known, else 0."""

    @classmethod
    def blank(cls, layout: Layout) -> "Sizes":
        """Sizes of the layout's shapes in which all coordinates are nearly logarithms."""
        return cls(jnp.full(_powers(layout).size, 1e9), jnp.zeros(()), jnp.zeros(()))


def _places(layout: Layout) -> np.ndarray:
    at = starts(layout)
    return np.array([at[name] for name in POWERS if name in at])


def _powers(layout: Layout) -> np.ndarray:
    at = starts(layout)
    return np.array([power for name, power in POWERS.items() if name in at])


def _sizes_of(
    typical: Float[np.ndarray, " n"],
    spread: Float[np.ndarray, " n"],
    error: Float[np.ndarray, " size"],
    layout: Layout,
) -> Sizes:
    """Sizes with these errors; contraction by its typical logarithm and that's standard deviation."""
    place = starts(layout).get(CONTRACTION)
    told = (0.0, 0.0) if place is None else (typical[place], float(spread[place] < KNOWN))
    return Sizes(jnp.asarray(error), *map(jnp.asarray, told))


def sizes_at_mode(
    mode: Float[np.ndarray, " n"], spread: Float[np.ndarray, " n"], layout: Layout
) -> Sizes:
    """Sizes from a most probable vector of logarithms and their standard deviations."""
    places = _places(layout)
    size = np.exp(_powers(layout) * mode[places])
    return _sizes_of(mode, spread, size * np.minimum(spread[places], 1.0), layout)


def sizes_of_draws(vectors: Float[np.ndarray, "draw n"], layout: Layout) -> Sizes:
    """Sizes from draws of vectors of logarithms."""
    error = np.exp(_powers(layout) * vectors[:, _places(layout)]).std(axis=0)
    return _sizes_of(vectors.mean(axis=0), vectors.std(axis=0), error, layout)


def _log_ratio(vector: Array, sizes: Sizes, layout: Layout) -> Float[Array, ""]:
    """Log of the contraction over its typical value where it is known, else 0."""
    return sizes.known * (vector[starts(layout)[CONTRACTION]] - sizes.contraction)


def unbent_sizes(bent: Float[Array, " n"], sizes: Sizes, layout: Layout) -> Unbent:
    """Logarithms from x, size = error log(1 + exp(x)), and bend from its product with contraction.

    Readings are so precise that along the ridges of what they leave open (of all muscle lengths that
    give one reading) the density is narrow, and curved in logarithms; in sizes these are straight.
    Where a size is below its error x is its logarithm.
    """
    places, powers = _places(layout), _powers(layout)
    x = bent[places]
    vector = bent.at[places].set(powers * (jnp.log(sizes.error) + log_softplus(x)))
    volume = jnp.sum(log_softplus_slope(x))
    if CONTRACTION in starts(layout):
        ratio = _log_ratio(vector, sizes, layout)
        vector = vector.at[starts(layout)[BEND]].multiply(jnp.exp(-ratio))
        volume = volume - ratio
    return Unbent(vector, volume)


def bent_sizes(vector: Float[Array, " n"], sizes: Sizes, layout: Layout) -> Float[Array, " n"]:
    """Inverse of `unbent_sizes`."""
    places, powers = _places(layout), _powers(layout)
    bent = vector.at[places].set(softplus_inverse(powers * vector[places] - jnp.log(sizes.error)))
    if CONTRACTION in starts(layout):
        ratio = _log_ratio(vector, sizes, layout)
        bent = bent.at[starts(layout)[BEND]].multiply(jnp.exp(ratio))
    return bent
