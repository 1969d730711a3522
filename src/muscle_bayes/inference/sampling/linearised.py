"""A surrogate of the posterior: the model's predictions taken as linear about a point."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import cho_solve, solve_triangular
from jaxtyping import Array, Float, Int

from muscle_bayes.inference.model.density import constrain, log_prior, prior_precision
from muscle_bayes.inference.model.lane_model import LanePrediction, Values, zeros_of
from muscle_bayes.inference.model.likelihood import (
    expected_reading,
    noise_of,
    reading_distribution,
)
from muscle_bayes.inference.model.problem import Data, Layout, Problem
from muscle_bayes.inference.running.programs import constrained_at, predictions_at
from muscle_bayes.inference.running.side_by_side import side_by_side
from muscle_bayes.inference.sampling.surrogate_transitions import Surrogate
from muscle_bayes.inference.search.tempering import entry_names

SHARES = (1.0, 0.1)
"""Lengths of secants, in posterior standard deviations. Of each direction the flatter counts: a surrogate
that is too wide has its proposals rejected, one that is too narrow keeps chains where they are."""


class Linearised(NamedTuple):
    """Predictions about a point, along directions that are a posterior standard deviation long."""

    point: Float[Array, " n"]
    """Unconstrained, of all sites; those that are not smooth are not looked at."""
    root: Float[Array, "m m"]
    """Its columns are the directions, in the smooth entries."""
    inverse_root: Float[Array, "m m"]
    predicted: list[LanePrediction]
    """At the point."""
    changes: list[Float[Array, "lane interval m"]]
    """Of the readings expected, along each direction. Secants, for motion is not smooth on all scales."""
    widths: Float[Array, " m"]
    """Of proposals along each direction: 1 where readings change as much either way, up to 2 elsewhere."""


def linearised(
    point: Float[np.ndarray, " n"],
    entries: Int[np.ndarray, " m"],
    covariance: Float[np.ndarray, "m m"],
    problem: Problem,
    workers: int = 1,
) -> Linearised:
    """Predictions at a point and about it, of the smooth `entries` with this covariance."""
    layout, data = problem.layout, problem.data
    root = np.linalg.cholesky(covariance)

    def expected(move: np.ndarray) -> list[np.ndarray]:
        there = np.array(point)
        there[entries] += move
        return jax.device_get(expected_at(jnp.asarray(there), layout, data))

    moves = [share * way for share in SHARES for way in root.T]
    ends = list(side_by_side(expected, [*moves, *(-move for move in moves)], workers))
    up, down = ends[: len(moves)], ends[len(moves) :]
    secants = [
        [np.nan_to_num(0.5 * (a - b)) / share for a, b in zip(*pair, strict=True)]
        for *pair, share in zip(up, down, np.repeat(SHARES, len(root)), strict=True)
    ]
    sizes = np.array([_size(one) for one in secants])
    chosen = np.argmin(sizes.reshape(len(SHARES), -1), axis=0) * len(root) + np.arange(len(root))
    changes = [
        jnp.asarray(np.stack(parts, -1))
        for parts in zip(*(secants[k] for k in chosen), strict=True)
    ]
    uneven = asymmetries(up[: len(root)], down[: len(root)], expected(np.zeros(len(root))))
    return Linearised(
        point=jnp.asarray(point),
        root=jnp.asarray(root),
        inverse_root=jnp.linalg.inv(root),
        predicted=predictions_at(jnp.asarray(point), layout, data),
        changes=changes,
        widths=jnp.asarray(1.0 + np.minimum(uneven, 1.0)),
    )


def asymmetries(
    up: Sequence[list[np.ndarray]], down: Sequence[list[np.ndarray]], still: list[np.ndarray]
) -> Float[np.ndarray, " m"]:
    """By how much the changes up and down each direction differ, over what they have in common.

    On the side where readings change less the posterior is wider than a normal one.
    """
    found = []
    for ends in zip(up, down, strict=True):
        parts = list(zip(*ends, still, strict=True))
        even = _size([a + b - 2.0 * c for a, b, c in parts])
        found.append(even / max(_size([a - b for a, b, _ in parts]), np.finfo(float).tiny))
    return np.array(found)


def _size(parts: Sequence[np.ndarray]) -> float:
    """Root of the sum of squares of what is finite."""
    return float(np.sqrt(sum(np.sum(part[np.isfinite(part)] ** 2) for part in parts)))


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
    layout: Layout, entries: Int[np.ndarray, " m"], spread: float
) -> Callable[[Linearised, Array, Data], Surrogate]:
    """The surrogate under a vector's noise, of the smooth `entries`.

    With predictions linear in u, so are the standardised one-step-ahead errors e of the readings. So the
    posterior of u is normal, of precision P = (de)'(de) + prior precision and mean P^-1 g, g being the
    slope of the log density at the point; the marginal density of the noise is the density at the point
    times exp(g' P^-1 g / 2) / sqrt(det P). `spread` and the directions' `widths` scale the standard
    deviations of what is proposed.
    """
    count = len(entries)
    row = np.full(len(entry_names(layout)), count)
    row[entries] = np.arange(count)

    def readings_say(about: Linearised, values: Values, data: Data) -> tuple[Array, Array, Array]:
        """Log likelihood at the point, its slope and precision along the directions."""
        total, gradient, precision = jnp.zeros(()), jnp.zeros(count), jnp.zeros((count, count))
        groups = zip(about.predicted, about.changes, data.lanes, layout.regimes, strict=True)
        for (one, changes, lanes, regime), cut in zip(groups, layout.segmented, strict=True):
            zeros = zeros_of(values, lanes, regime, cut)
            found = reading_distribution(lanes, zeros, one, noise_of(values, regime), regime)
            slopes = found.sensitivities(changes).reshape(-1, count)
            for readings in (
                [lanes.reading] if lanes.again is None else [lanes.reading, lanes.again]
            ):
                seen = found.innovations(readings)
                total += seen.log_density.sum()
                gradient -= slopes.T @ seen.errors.ravel()
                precision += slopes.T @ slopes
        return total, gradient, precision

    def surrogate(about: Linearised, vector: Array, data: Data) -> Surrogate:
        directions = jnp.vstack([about.root, jnp.zeros((1, count))])[row]
        start = jnp.where(row < count, about.point, vector)
        total, gradient, precision = readings_say(about, constrain(start, layout, data), data)
        prior, pull = jax.value_and_grad(log_prior)(start, layout, data)
        gradient += directions.T @ pull
        precision += directions.T @ prior_precision(start, layout, data) @ directions
        widths = spread * about.widths
        lower = jnp.linalg.cholesky(precision)
        mean = cho_solve((lower, True), gradient)
        log_determinant = jnp.sum(jnp.log(jnp.diag(lower)))
        wide = solve_triangular(lower, jnp.eye(count), lower=True).T
        return Surrogate(
            log_marginal=prior + total + 0.5 * gradient @ mean - log_determinant,
            centre=about.point[entries] + about.root @ mean,
            root=about.root @ (widths[:, None] * wide),
            inverse_root=(lower.T / widths) @ about.inverse_root,
            log_volume=-log_determinant,
        )

    return surrogate
