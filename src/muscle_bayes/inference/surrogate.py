"""Predictions taken for linear over the posterior: what trajectories follow between simulations."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.bent_rows import bent_rows, unbent_rows
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.lane_model import LanePrediction
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.programs import potential_with, predictions_at
from muscle_bayes.inference.whitening import Whitening

POINTS = 4
"""Simulations per coordinate from which the slopes are first told."""
MOST_POINTS = 400
"""Draws from which they are told later."""
FAR = 10.0
"""Nats by which a point may be less likely than the whitening has it, compared with the middle one, and
tell slopes. Beyond the edge of a dead band readings jump, to which no slope leads."""


class Surrogate(NamedTuple):
    """predicted(x) = middle + slope @ x, x = (z, bent walled entries - their centre)."""

    middle: list[LanePrediction]
    slope: list[LanePrediction]
    """Along the last axis."""

    def at(self, x: Float[Array, " x"]) -> list[LanePrediction]:
        """Predictions at x."""
        return jax.tree.map(lambda middle, slope: middle + slope @ x, self.middle, self.slope)


def blank_surrogate(shapes: list[LanePrediction], layout: Layout) -> Surrogate:
    """A surrogate of the layout's and the predictions' shapes that holds nothing."""
    inner, outer, _ = blocks(layout)
    size = inner.size + outer.size
    middle = jax.tree.map(lambda one: jnp.zeros(one.shape, one.dtype), shapes)
    return Surrogate(
        middle, jax.tree.map(lambda one: jnp.zeros((*one.shape, size), one.dtype), shapes)
    )


def surrogate_of(
    x: Float[np.ndarray, "point x"], predicted: Sequence[list[LanePrediction]]
) -> Surrogate:
    """Least squares of predictions at points; points that cannot be simulated are left out.

    Coordinates in which the points do not vary have no slope (least norm).
    """
    usable = [
        index
        for index, one in enumerate(predicted)
        if all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(one))
        and all(np.all(lanes.finite > 0.0) for lanes in one)
    ]
    # One of nothing but such points says nothing, and is given up for what it leads to.
    usable = usable or [0]
    columns = np.concatenate([np.ones((len(usable), 1)), x[usable]], axis=1)
    solve = np.linalg.pinv(columns)
    structure = jax.tree.structure(predicted[0])
    rows = [jax.tree.leaves(predicted[index]) for index in usable]
    middle, slope = [], []
    for leaves in zip(*rows, strict=True):
        found = np.tensordot(solve, np.stack(leaves), 1)
        middle.append(jnp.asarray(found[0]))
        slope.append(jnp.asarray(np.moveaxis(found[1:], 0, -1)))
    return Surrogate(jax.tree.unflatten(structure, middle), jax.tree.unflatten(structure, slope))


def first_surrogate(key: Array, white: Whitening, layout: Layout, data: Data) -> Surrogate:
    """From points as the whitening has the posterior: wide differences instead of derivatives.

    Those that the posterior does not have (FAR) are left out.
    """
    inner = blocks(layout).smooth
    z = np.asarray(jax.random.normal(key, (POINTS * inner.size, inner.size)))
    points = np.tile(np.asarray(white.centre), (len(z), 1))
    points[:, inner] += z @ np.asarray(white.factor).T
    vectors = unbent_rows(points, white.bend, layout, data)
    predicted = _predicted(vectors, layout, data)
    energy = [
        float(potential_with(there, jnp.asarray(vector), layout, data))
        for there, vector in zip(predicted, vectors, strict=True)
    ]
    surprise = np.nan_to_num(np.array(energy) - 0.5 * np.sum(z**2, axis=1), nan=np.inf)
    near = np.flatnonzero(surprise <= np.median(surprise) + FAR)
    return _through(vectors[near], [predicted[index] for index in near], white, layout, data)


def learned_surrogate(
    vectors: Float[np.ndarray, "draw n"], white: Whitening, layout: Layout, data: Data
) -> Surrogate:
    """From draws of the posterior, at most MOST_POINTS of them."""
    spread = np.linspace(0, len(vectors) - 1, min(MOST_POINTS, len(vectors))).astype(int)
    chosen = vectors[spread]
    return _through(chosen, _predicted(chosen, layout, data), white, layout, data)


def _predicted(
    vectors: Float[np.ndarray, "point n"], layout: Layout, data: Data
) -> list[list[LanePrediction]]:
    return [jax.device_get(predictions_at(one, layout, data)) for one in vectors]


def _through(
    vectors: Float[np.ndarray, "point n"],
    predicted: Sequence[list[LanePrediction]],
    white: Whitening,
    layout: Layout,
    data: Data,
) -> Surrogate:
    """Of points whose predictions are known."""
    inner, outer, _ = blocks(layout)
    away = bent_rows(vectors, white.bend, layout, data) - np.asarray(white.centre)
    z = np.linalg.solve(np.asarray(white.factor), away[:, inner].T).T
    return surrogate_of(np.hstack([z, away[:, outer]]), predicted)
