"""The smooth sites' normal approximation, and starts of chains as wide as it."""

from collections.abc import Collection
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from muscle_bayes.inference.model.problem import Layout, Problem
from muscle_bayes.inference.running.programs import potential_at
from muscle_bayes.inference.search.factored import FactoredPrecision
from muscle_bayes.inference.search.mode import Mode, descended
from muscle_bayes.inference.search.tempering import entry_names


class Normal(NamedTuple):
    """The smooth sites, unconstrained, as the Fisher information at a point has them."""

    names: tuple[str, ...]
    """Site of each smooth entry."""
    entries: Int[np.ndarray, " m"]
    """Their places in the unconstrained vector."""
    point: Float[np.ndarray, " n"]
    """The whole vector: their mean, and where the other sites are."""
    covariance: Float[np.ndarray, "m m"]


def entries_of(sites: Collection[str], layout: Layout) -> Int[np.ndarray, " m"]:
    """Places of these sites in the unconstrained vector."""
    return np.flatnonzero(np.isin(entry_names(layout), list(sites)))


def normal_at(mode: Mode, layout: Layout, smooth: Collection[str]) -> Normal:
    """The normal approximation of the smooth sites."""
    names, entries = np.array(entry_names(layout)), entries_of(smooth, layout)
    covariance = FactoredPrecision(np.asarray(mode.information)[np.ix_(entries, entries)]).inverse()
    return Normal(tuple(names[entries]), entries, np.asarray(mode.vector), covariance)


def normal_of_typical(
    point: Float[np.ndarray, " n"], problem: Problem, smooth: Collection[str]
) -> Normal:
    """The normal approximation of the smooth sites where all others are as at a point.

    At the mode of the joint density the noise is smaller than in most of the posterior, and so is the
    spread of all that readings tell.
    """
    layout = problem.layout
    others = np.setdiff1d(np.arange(point.size), entries_of(smooth, layout))
    return normal_at(descended(point, layout, problem.data, list(others)), layout, smooth)


def dispersed(
    rng: np.random.Generator, mode: Mode, smooth: np.ndarray, problem: Problem
) -> Float[np.ndarray, " n"]:
    """A point about the mode, as wide as the Fisher information and not less likely than a draw.

    From a far less likely one the minimum forces would be driven where they stay for long.
    """
    away = FactoredPrecision(np.asarray(mode.information)).spread(
        rng.standard_normal(len(mode.vector))
    )
    for halving in range(8):
        place = np.array(mode.vector)
        place[smooth] += 0.5**halving * away[smooth]
        value = potential_at(jnp.asarray(place), problem.layout, problem.data)
        if value < mode.potential + place.size:
            return place
    return np.array(mode.vector)
