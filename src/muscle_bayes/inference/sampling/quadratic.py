"""A surrogate of the posterior: the model's predictions taken as quadratic about a point."""

from collections.abc import Callable
from itertools import combinations
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import cho_solve, solve_triangular
from jaxtyping import Array, Float, Int

from muscle_bayes.inference.model.density import constrain, log_prior
from muscle_bayes.inference.model.lane_model import LanePrediction, Values, zeros_of
from muscle_bayes.inference.model.likelihood import (
    expected_reading,
    noise_of,
    reading_distribution,
)
from muscle_bayes.inference.model.problem import Data, Layout, Problem
from muscle_bayes.inference.running.programs import constrained_at, predictions_at
from muscle_bayes.inference.running.side_by_side import side_by_side
from muscle_bayes.inference.sampling.surrogate_transitions import Rough, Surrogate
from muscle_bayes.inference.search.mode import LEAST_PRECISION
from muscle_bayes.inference.search.tempering import entry_names


class Expansion(NamedTuple):
    """Predictions about a point, along directions that are a posterior standard deviation long."""

    point: Float[Array, " n"]
    """Unconstrained, of all sites; those that are not smooth are not looked at."""
    root: Float[Array, "m m"]
    """Its columns are the directions, in the smooth entries."""
    inverse_root: Float[Array, "m m"]
    predicted: list[LanePrediction]
    """At the point."""
    changes: list[Float[Array, "lane interval f"]]
    """Of the readings expected: along each direction, then with each product of two places along them.
    Secants, for motion is not smooth on all scales."""
    first: Int[Array, " p"]
    second: Int[Array, " p"]
    """Which two directions each product is of."""


class Said(NamedTuple):
    """What the readings say under a vector's noise: total + slope f - f' precision f / 2, of features f."""

    total: Float[Array, ""]
    slope: Float[Array, " f"]
    precision: Float[Array, "f f"]


def expanded(
    point: Float[np.ndarray, " n"],
    entries: Int[np.ndarray, " m"],
    covariance: Float[np.ndarray, "m m"],
    problem: Problem,
    workers: int = 1,
    *,
    shares: tuple[float, ...] = (1.0, 0.1),
    bent: int = 5,
) -> Expansion:
    """Predictions at a point and about it.

    Motion is not smooth on all scales. So differences are taken over several lengths, and in each direction
    the flatter one counts: too wide a surrogate has its proposals rejected, too narrow a one keeps chains
    where they are.

    Args:
        point: unconstrained, of all sites.
        entries: places of the smooth ones.
        covariance: of these in the posterior, about.
        problem: whose predictions they are.
        workers: predictions at a time.
        shares: lengths of the differences, in posterior standard deviations.
        bent: directions in which second differences are taken, the most curved ones.
    """
    layout, data = problem.layout, problem.data
    scales, ways = np.linalg.eigh(covariance)
    root = ways * np.sqrt(scales)
    whole = np.eye(len(root))

    def expected(moves: list[np.ndarray]) -> list[np.ndarray]:
        """Of all lanes, one row for each move along the directions."""

        def one(move: np.ndarray) -> np.ndarray:
            there = np.array(point)
            there[entries] += root @ move
            found = jax.device_get(expected_at(jnp.asarray(there), layout, data))
            return np.concatenate([part.ravel() for part in found])

        return list(side_by_side(one, moves, workers))

    (here,) = expected([np.zeros(len(root))])

    def up_and_down(moves: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        found = np.array(expected([*moves, *(-move for move in moves)])).reshape(-1, here.size)
        return found[: len(moves)], found[len(moves) :]

    slopes, bends = [], []
    for share in shares:
        up, down = up_and_down(list(share * whole))
        slopes.append((up - down) / (2.0 * share))
        bends.append((up + down - 2.0 * here) / share**2)
    most = np.argsort(-np.sum(_flattest(bends) ** 2, axis=1))[:bent]
    pairs = list(combinations(most.tolist(), 2))
    crossed = []
    for share, bend in zip(shares, bends, strict=True):
        # e(i + j) + e(-i - j) - 2 e(0) has the bends of i and of j, and twice that of their product.
        ends = up_and_down([share * (whole[i] + whole[j]) for i, j in pairs])
        own = np.array([bend[i] + bend[j] for i, j in pairs]).reshape(-1, here.size)
        crossed.append(0.5 * ((sum(ends) - 2.0 * here) / share**2 - own))
    first, second = np.array([*((i, i) for i in most), *pairs]).T
    at_point = predictions_at(jnp.asarray(point), layout, data)
    sizes = [lanes.reading.shape for lanes in data.lanes]

    rows = np.vstack([_flattest(slopes), 0.5 * _flattest(bends)[most], _flattest(crossed)])
    parts = np.split(rows, np.cumsum([np.prod(size) for size in sizes])[:-1], axis=1)
    return Expansion(
        jnp.asarray(point),
        jnp.asarray(root),
        jnp.asarray(np.linalg.inv(root)),
        at_point,
        [jnp.asarray(part.T.reshape(*size, -1)) for part, size in zip(parts, sizes, strict=True)],
        jnp.asarray(first),
        jnp.asarray(second),
    )


def _flattest(each: list[Float[np.ndarray, "m n"]]) -> Float[np.ndarray, "m n"]:
    """Of each row the smallest."""
    rows = np.nan_to_num(np.array(each))
    smallest = np.argmin(np.sum(rows**2, axis=2), axis=0)
    return np.take_along_axis(rows, smallest[None, :, None], axis=0)[0]


def expected_at(vector: Float[Array, " n"], layout: Layout, data: Data) -> list[Array]:
    """The readings that the model expects of every lane at an unconstrained vector."""
    values = constrained_at(vector, layout, data)
    predicted = predictions_at(vector, layout, data)
    groups = zip(predicted, data.lanes, layout.regimes, layout.segmented, strict=True)
    return [
        expected_reading(lanes, zeros_of(values, lanes, regime, cut), one)
        for one, lanes, regime, cut in groups
    ]


def surrogate_of(
    layout: Layout, entries: Int[np.ndarray, " m"], far: float = 2.5
) -> Callable[[Expansion, Data], Surrogate[Said]]:
    """The surrogate of an expansion, with these smooth `entries`.

    With u along the directions, and features f of u and of products of two, predictions are linear in f. So
    are the standardised one-step-ahead errors e of the readings. Under any noise the log likelihood is a
    quadratic form of f, of precision (de)'(de): once known, it needs no readings. In products, u levels off
    at `far` standard deviations, for bends seldom go on.
    """
    count = len(entries)
    row = np.full(len(entry_names(layout)), count)
    row[entries] = np.arange(count)

    def said(about: Expansion, values: Values, data: Data) -> Said:
        size = count + about.first.size
        total, slope, precision = jnp.zeros(()), jnp.zeros(size), jnp.zeros((size, size))
        groups = zip(about.predicted, about.changes, data.lanes, layout.regimes, strict=True)
        for (one, changes, lanes, regime), cut in zip(groups, layout.segmented, strict=True):
            zeros = zeros_of(values, lanes, regime, cut)
            found = reading_distribution(lanes, zeros, one, noise_of(values, regime), regime)
            slopes = found.sensitivities(changes).reshape(-1, size)
            for readings in (
                [lanes.reading] if lanes.again is None else [lanes.reading, lanes.again]
            ):
                seen = found.innovations(readings)
                total += seen.log_density.sum()
                slope -= slopes.T @ seen.errors.ravel()
                precision += slopes.T @ slopes
        return Said(total, slope, precision)

    def surrogate(about: Expansion, data: Data) -> Surrogate[Said]:
        def under(vector: Array) -> tuple[Said, Rough]:
            directions = jnp.vstack([about.root, jnp.zeros((1, count))])[row]
            start = jnp.where(row < count, about.point, vector)
            found = said(about, constrain(start, layout, data), data)
            pull, bend = jax.jvp(
                lambda v: jax.grad(log_prior)(v, layout, data), (start,), (jnp.ones_like(start),)
            )
            stiff = jnp.maximum(-bend, LEAST_PRECISION)
            slope = found.slope[:count] + directions.T @ pull
            precision = found.precision[:count, :count] + directions.T @ (
                stiff[:, None] * directions
            )
            lower = jnp.linalg.cholesky(precision)
            wide = solve_triangular(lower, jnp.eye(count), lower=True).T
            return found, Rough(
                centre=about.point[entries] + about.root @ cho_solve((lower, True), slope),
                root=about.root @ wide,
                inverse_root=lower.T @ about.inverse_root,
                log_volume=-jnp.sum(jnp.log(jnp.diag(lower))),
            )

        def log_density(found: Said, vector: Array, power: Array) -> Array:
            u = about.inverse_root @ (vector[entries] - about.point[entries])
            bent = far * jnp.tanh(u / far)
            features = jnp.concatenate([u, bent[about.first] * bent[about.second]])
            said = found.slope @ features - 0.5 * features @ found.precision @ features
            return power * (found.total + said) + log_prior(vector, layout, data)

        return Surrogate(under, log_density)

    return surrogate
