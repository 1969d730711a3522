"""The smooth sites' normal approximation, and starts of chains as wide as it."""

from collections.abc import Collection
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from muscle_bayes.inference.model.problem import Layout, Problem
from muscle_bayes.inference.running.programs import potential_at
from muscle_bayes.inference.search.factored import FactoredPrecision
from muscle_bayes.inference.search.mode import Mode, descended, seen_at
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
    rng: np.random.Generator, mode: Mode, smooth: Int[np.ndarray, " m"], problem: Problem
) -> Float[np.ndarray, " n"]:
    """A point about the mode, as wide as the Fisher information and not less likely than a draw.

    From a far less likely one the minimum forces would be driven where they stay for long. Where no such
    point is in a straight line the posterior is curved, and chains that all begin near its mode would
    agree long before they have seen how wide it is: then the curve is followed.
    """
    kicks = rng.standard_normal(len(mode.vector))
    away = FactoredPrecision(np.asarray(mode.information)).spread(kicks)[smooth]

    def moved(share: float) -> Float[np.ndarray, " n"]:
        place = np.array(mode.vector)
        place[smooth] += share * away
        return place

    def is_likely(place: Float[np.ndarray, " n"]) -> bool:
        value = potential_at(jnp.asarray(place), problem.layout, problem.data)
        return bool(value < mode.potential + place.size)

    if is_likely(moved(1.0)):
        return moved(1.0)
    places = along_valley(mode, smooth, kicks[smooth], problem)[::-1]
    places += [moved(0.5**halving) for halving in range(1, 8)]
    return next(filter(is_likely, places), np.array(mode.vector))


def along_valley(
    mode: Mode,
    smooth: Int[np.ndarray, " m"],
    kicks: Float[np.ndarray, " m"],
    problem: Problem,
    *,
    loose: float = 0.03,
    stages: int = 6,
    corrections: int = 2,
) -> list[Float[np.ndarray, " n"]]:
    """Points from the mode to a given place along the directions that the data leave loose.

    In small stages these directions, fixed at the mode, are followed, and after each the smooth entries
    are corrected in all directions across, by Gauss-Newton: a predictor-corrector path, of points that
    are the likeliest with their place along it.

    Args:
        mode: where the path begins.
        smooth: places of the entries that move.
        kicks: standard normal numbers; the first tell the place along the loose directions, in standard
            deviations.
        problem: whose posterior it is.
        loose: standard deviation of an unconstrained direction, mostly a relative one, from which on it
            is followed.
        stages: of the path.
        corrections: after each.
    """
    information = np.asarray(mode.information)[np.ix_(smooth, smooth)]
    precisions, ways = np.linalg.eigh(information)
    count = int(np.sum(precisions < loose**-2))
    stage = ways[:, :count] @ (kicks[:count] / np.sqrt(precisions[:count])) / stages
    across = ways[:, count:]
    place = np.array(mode.vector)
    path: list[np.ndarray] = []
    for _ in range(stages):
        place[smooth] += stage
        for _ in range(corrections):
            seen = seen_at(jnp.asarray(place), problem.layout, problem.data)
            slope = across.T @ np.asarray(seen.gradient)[smooth]
            bend = across.T @ np.asarray(seen.information)[np.ix_(smooth, smooth)] @ across
            if not (np.isfinite(slope).all() and np.isfinite(bend).all()):
                return path
            place[smooth] -= across @ FactoredPrecision(bend).solve(slope)
        path.append(place.copy())
    return path
