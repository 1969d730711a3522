"""The coordinate in which D is sampled where the data tell little of it, for the sampler alone."""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.bend_hyst import TIME, Unbent, durations, starts
from muscle_bayes.inference.log_softplus import log_softplus, log_softplus_slope, softplus_inverse
from muscle_bayes.inference.problem import Data, Layout

FRICTION, STIFFNESS = "D", "stiffness_hyst"
LOOSE = 0.2
"""Standard deviation of log D above which D is badly told."""
WIDEST_GROWTH = 30.0
"""Largest logarithm of D's growth over D that is looked at: beyond, the data tell nothing of D."""
BISECTIONS = 5
LARGE_RISE = 1e9


class FrictionScale(NamedTuple):
    """To what D is referred."""

    error: Float[Array, ""]
    """Friction that just shows, over its reference."""
    creep: Float[Array, ""]
    """1 where the reference is the friction that alters HYST's creep by 1, 0 where it is 1."""


def place_of_friction(layout: Layout) -> int:
    """Index of log D in the unconstrained vector."""
    return starts(layout)[FRICTION]


def log_reference(vector: Array, layout: Layout, data: Data) -> Float[Array, ""]:
    """Log of the friction that alters the strain to which HYST creeps in the longest record by 1.

    stiffness_hyst / (1 - exp(-duration / time constant)); without a muscle 1.
    """
    duration = durations(layout, data)
    if not duration.size:
        return jnp.zeros(())
    at = starts(layout)
    share = -jnp.expm1(-jnp.max(duration) * jnp.exp(-vector[at[TIME]]))
    return vector[at[STIFFNESS]] - jnp.log(share)


def scale_at_mode(
    energy_of: Callable[[Array], float],
    mode: Float[Array, " n"],
    reference: float,
    layout: Layout,
) -> FrictionScale:
    """The scale with which the data tell D, given the rest of the mode.

    Half of what D must grow for the negative log density `energy_of` to rise by 2, as a normal
    density does at two standard deviations. Found even where the most probable D shows no effect, of
    which the Fisher information there tells nothing. `reference` is its `log_reference`.
    """
    place = place_of_friction(layout)
    least, log_d = energy_of(mode), float(mode[place])

    def excess(log_growth: float) -> float:
        grown = np.array(mode)
        grown[place] = np.logaddexp(log_d, log_growth)
        rise = energy_of(grown) - least - 2.0
        return rise if np.isfinite(rise) else LARGE_RISE

    low = high = log_d - np.log(1e4)
    while excess(high) < 0.0 and high < log_d + WIDEST_GROWTH:
        low, high = high, high + 2.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) < 0.0 else (low, middle)
    log_error = high - np.log(2.0)
    creep = float(log_error - log_d > np.log(LOOSE))
    log_error -= creep * reference
    return FrictionScale(jnp.asarray(np.exp(log_error)), jnp.asarray(creep))


def scale_of_draws(
    log_d: Float[np.ndarray, " draw"], reference: Float[np.ndarray, " draw"]
) -> FrictionScale:
    """The scale of what draws tell of D; `reference` is the `log_reference` of each."""
    creep = float(log_d.std() > LOOSE)
    error = np.exp(log_d - creep * reference).std()
    return FrictionScale(jnp.asarray(error), jnp.asarray(creep))


def unbent_friction(
    bent: Float[Array, " n"], scale: FrictionScale, layout: Layout, data: Data
) -> Unbent:
    """log D from x, D = error reference log(1 + exp(x)).

    Friction shows in proportion to D and not at all below some size: in log D the density falls
    ever more steeply above that size, in x as a normal density does. Where D is badly told, what
    shows is its share in HYST's creep; where it is well told, the reference is 1, lest D be carried
    along by what is not.
    """
    place = place_of_friction(layout)
    x = bent[place]
    log_unit = jnp.log(scale.error) + scale.creep * log_reference(bent, layout, data)
    return Unbent(bent.at[place].set(log_unit + log_softplus(x)), log_softplus_slope(x))


def bent_friction(
    vector: Float[Array, " n"], scale: FrictionScale, layout: Layout, data: Data
) -> Float[Array, " n"]:
    """Inverse of `unbent_friction`."""
    place = place_of_friction(layout)
    log_unit = jnp.log(scale.error) + scale.creep * log_reference(vector, layout, data)
    return vector.at[place].set(softplus_inverse(vector[place] - log_unit))
