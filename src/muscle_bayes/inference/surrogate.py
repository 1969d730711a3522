"""Predictions over the posterior, linear but for dry friction: what trajectories follow."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.bent_rows import bent_rows, unbent_rows
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.dead_bands import DeadBand, blank_bands, fitted_bands
from muscle_bayes.inference.first_edges import Frame
from muscle_bayes.inference.lane_model import LanePrediction
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.programs import potential_with, predictions_at
from muscle_bayes.inference.ridge import scattered
from muscle_bayes.inference.squeeze import unsqueezed
from muscle_bayes.inference.whitening import Whitening

POINTS = 4
"""Simulations per coordinate from which the slopes are first told."""
MOST_POINTS = 400
"""Draws from which they are told later."""
FAR = 30.0
"""Nats by which a point may be less likely than the whitening has it, compared with the middle one, and
tell slopes. Where a spring opens or shuts readings jump, to which no slope leads."""


class Surrogate(NamedTuple):
    """predicted(x) = band(x) + middle + slope @ x + kink @ beyond(x), x that of `Place`.

    Without `band` and `beyond` where nothing is held.
    """

    middle: list[LanePrediction]
    slope: list[LanePrediction]
    """Along the last axis."""
    kink: list[LanePrediction]
    """Along the last axis, one for each edge of a dead band that a lane begins in."""
    bands: list[DeadBand | None]
    """Where friction holds the rotor; None where nothing is held."""

    def at(self, x: Float[Array, " x"]) -> list[LanePrediction]:
        """Predictions at x."""
        beyond = _beyond(self.bands, x)

        def predict(middle: Array, slope: Array, kink: Array) -> Array:
            return middle + slope @ x + kink @ beyond

        rest = jax.tree.map(predict, self.middle, self.slope, self.kink)
        return [
            one if band is None else one._replace(reading=one.reading + band.at(x))
            for one, band in zip(rest, self.bands, strict=True)
        ]


def _beyond(bands: list[DeadBand | None], x: Float[Array, " x"]) -> Float[Array, " edge"]:
    return jnp.concatenate([jnp.zeros(0), *(band.beyond(x) for band in bands if band is not None)])


def blank_surrogate(shapes: list[LanePrediction], layout: Layout) -> Surrogate:
    """A surrogate of the layout's and the predictions' shapes that holds nothing."""
    inner, outer, _ = blocks(layout)
    size = inner.size + outer.size
    bands = blank_bands(shapes, layout, size)

    def along(count: int) -> list[LanePrediction]:
        return jax.tree.map(lambda one: jnp.zeros((*one.shape, count), one.dtype), shapes)

    middle = jax.tree.map(lambda one: jnp.zeros(one.shape, one.dtype), shapes)
    return Surrogate(middle, along(size), along(_beyond(bands, jnp.zeros(size)).size), bands)


def surrogate_of(
    x: Float[np.ndarray, "point x"],
    predicted: Sequence[list[LanePrediction]],
    bands: list[DeadBand | None],
) -> Surrogate:
    """Least squares of predictions at points; points that cannot be simulated are left out.

    Coordinates in which the points do not vary have no slope, edges that all lie within no kink (least
    norm).
    """
    usable = [
        index
        for index, one in enumerate(predicted)
        if all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(one))
        and all(np.all(lanes.finite > 0.0) for lanes in one)
    ]
    # One of nothing but such points says nothing, and is given up for what it leads to.
    usable = usable or [0]
    beyond = np.stack([np.asarray(_beyond(bands, jnp.asarray(one))) for one in x[usable]])
    columns = np.concatenate([np.ones((len(usable), 1)), x[usable], beyond], axis=1)
    solve = np.linalg.pinv(columns)
    structure = jax.tree.structure(predicted[0])
    rows = [jax.tree.leaves(_without(bands, predicted[index], x[index])) for index in usable]
    middle, slope, kink = [], [], []
    for leaves in zip(*rows, strict=True):
        found = np.tensordot(solve, np.stack(leaves), 1)
        middle.append(jnp.asarray(found[0]))
        along = np.moveaxis(found[1:], 0, -1)
        slope.append(jnp.asarray(along[..., : x.shape[1]]))
        kink.append(jnp.asarray(along[..., x.shape[1] :]))

    def whole(leaves: list[Array]) -> list[LanePrediction]:
        return jax.tree.unflatten(structure, leaves)

    return Surrogate(whole(middle), whole(slope), whole(kink), bands)


def _without(
    bands: list[DeadBand | None], predicted: list[LanePrediction], x: Float[np.ndarray, " x"]
) -> list[LanePrediction]:
    """What bands leave of predictions."""
    return [
        one if band is None else one._replace(reading=one.reading - np.asarray(band.at(x)))
        for one, band in zip(predicted, bands, strict=True)
    ]


class _Points(NamedTuple):
    """Unconstrained vectors, and what the model says there."""

    vectors: Float[np.ndarray, "point n"]
    predicted: list[list[LanePrediction]]


def _dispersed(key: Array, white: Whitening, layout: Layout, data: Data) -> _Points:
    """Points as the whitening has the posterior, but for those that the posterior does not have (FAR)."""
    inner = blocks(layout).smooth
    z = np.asarray(jax.random.normal(key, (POINTS * inner.size, inner.size)))
    points = np.tile(np.asarray(white.centre), (len(z), 1))
    points[:, inner] += z @ np.asarray(white.factor).T
    points = np.asarray(unsqueezed(jnp.asarray(points), white.squeeze).bent)
    points = scattered(points, white.ridge, np.random.default_rng(0))
    vectors = unbent_rows(points, white.bend, layout, data)
    predicted = _predicted(vectors, layout, data)
    energy = [
        float(potential_with(there, jnp.asarray(vector), layout, data))
        for there, vector in zip(predicted, vectors, strict=True)
    ]
    surprise = np.nan_to_num(np.array(energy) - 0.5 * np.sum(z**2, axis=1), nan=np.inf)
    near = np.flatnonzero(surprise <= np.median(surprise) + FAR)
    return _Points(vectors[near], [predicted[index] for index in near])


def first_surrogate(key: Array, white: Whitening, layout: Layout, data: Data) -> Surrogate:
    """From points as the whitening has the posterior: wide differences instead of derivatives."""
    return _through(_dispersed(key, white, layout, data), white, layout, data)


def learned_surrogate(
    key: Array,
    vectors: Float[np.ndarray, "draw n"],
    white: Whitening,
    layout: Layout,
    data: Data,
) -> Surrogate:
    """From draws of the posterior as well, at most MOST_POINTS of them.

    Draws alone would not do: early ones are few, and follow each other.
    """
    spread = np.linspace(0, len(vectors) - 1, min(MOST_POINTS, len(vectors))).astype(int)
    chosen = vectors[spread]
    others = _dispersed(key, white, layout, data)
    points = _Points(
        np.concatenate([chosen, others.vectors]),
        [*_predicted(chosen, layout, data), *others.predicted],
    )
    return _through(points, white, layout, data)


def _predicted(
    vectors: Float[np.ndarray, "point n"], layout: Layout, data: Data
) -> list[list[LanePrediction]]:
    return [jax.device_get(predictions_at(one, layout, data)) for one in vectors]


def _through(points: _Points, white: Whitening, layout: Layout, data: Data) -> Surrogate:
    inner, outer, _ = blocks(layout)
    vectors, predicted = points
    frame = Frame(np.asarray(white.centre), np.asarray(white.factor), inner, outer)
    x = frame.of(bent_rows(vectors, white.bend, layout, data))
    return surrogate_of(x, predicted, fitted_bands(x, vectors, layout, data))
