"""The whitening that draws of the posterior give, beside the one at its mode."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from muscle_bayes.inference.bend import Bend
from muscle_bayes.inference.bend_friction import place_of_friction, scale_of_draws
from muscle_bayes.inference.bend_sizes import sizes_of_draws
from muscle_bayes.inference.bent_rows import bent_rows, unbent_rows, unscaled_rows
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.first_edges import Frame, squeeze_at
from muscle_bayes.inference.noise_moves import refit
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.program import Program
from muscle_bayes.inference.ridge import Ridge, ridge_of
from muscle_bayes.inference.squeeze import squeezed
from muscle_bayes.inference.typical_misfit import typical_misfit
from muscle_bayes.inference.whitening import Whitening

LONG = 2.5
"""Standard deviation of draws along a direction, in that of the whitening, from which on it is learned."""
TRUST = 20.0
"""Draws that the whitening at the mode counts for when it is rescaled."""

_refit = Program(refit)


def _learned_ridge(
    white: Whitening,
    bend: Bend,
    bent: Float[np.ndarray, "draw n"],
    layout: Layout,
    data: Data,
) -> Ridge:
    """From the covariance of draws, in the coordinates of `bend`, as well."""
    outer = blocks(layout).walled
    if not outer.size:
        return white.ridge
    spread = np.asarray(white.ridge.spread)
    steps = spread[:, None] * np.asarray(white.ridge.direction)
    ends = np.asarray(white.centre) + np.concatenate([steps, -steps])
    ahead, back = np.split(
        bent_rows(unbent_rows(ends, white.bend, layout, data), bend, layout, data), 2
    )
    known = 0.5 * spread[:, None] * (ahead - back)
    away = bent - bent.mean(axis=0)
    seen = away[:, outer].T @ away
    middle = bent[:, outer].mean(axis=0)
    return ridge_of(middle, (seen + TRUST * known) / (len(bent) + TRUST), layout)


def _given(
    told: Float[np.ndarray, "draw told"], rows: Float[np.ndarray, "draw smooth"]
) -> Float[np.ndarray, "draw smooth"]:
    """Rows less what their means move by with walled entries.

    Trajectories hold these: what smooth entries do together with them would make the whitening too wide.
    """
    away = told - told.mean(axis=0)
    return rows - away @ np.linalg.lstsq(away, rows - rows.mean(axis=0), rcond=None)[0]


def _lengthened(z: Float[np.ndarray, "draw smooth"]) -> Float[np.ndarray, "smooth smooth"]:
    """What makes whitened coordinates as long as draws have them, in directions that these are LONG in.

    Few draws tell such a direction well. Variances of single coordinates alone would make all that it
    passes through too wide.
    """
    values, directions = np.linalg.eigh(np.cov(z.T))
    long = values > LONG**2
    along = directions[:, long]
    return np.eye(len(values)) + (along * (np.sqrt(values[long]) - 1.0)) @ along.T


def _triangular(factor: Float[np.ndarray, "smooth smooth"]) -> Float[np.ndarray, "smooth smooth"]:
    """The lower triangular factor of the same covariance."""
    root = np.linalg.qr(factor.T, mode="r").T
    return root * np.sign(np.diag(root))


def rewhiten(
    white: Whitening,
    vectors: Float[np.ndarray, "chain draw n"],
    layout: Layout,
    data: Data,
) -> tuple[Whitening, Float[np.ndarray, "chain smooth"]]:
    """A whitening by the covariance of draws as well, and the last draws in it.

    The Fisher information at the mode tells little where the data tell little.
    """
    inner, outer, noise = blocks(layout)
    pooled = vectors.reshape(-1, vectors.shape[-1])
    references, logs = unscaled_rows(pooled, layout, data)
    friction = scale_of_draws(pooled[:, place_of_friction(layout)], references)
    bend = Bend(friction, sizes_of_draws(logs, layout))
    before, there = (bent_rows(pooled, one, layout, data) for one in (white.bend, bend))
    frame = Frame(there.mean(axis=0), np.diag(there[:, inner].std(axis=0)), inner, outer)
    squeeze = squeeze_at(frame.of(there), pooled, frame, layout, data)
    ridge = _learned_ridge(white, bend, there, layout, data)
    told = there[:, outer]
    whole = np.asarray(squeezed(jnp.asarray(there), squeeze))[:, inner]
    before, after = (
        _given(told, np.asarray(squeezed(jnp.asarray(rows), one))[:, inner])
        for rows, one in ((before, white.squeeze), (there, squeeze))
    )
    # Rows whose coordinate has changed.
    stretch = after.std(axis=0) / before.std(axis=0)
    centre, factor = after.mean(axis=0), np.asarray(white.factor) * stretch[:, None]

    def whitened(points: np.ndarray) -> np.ndarray:
        return np.linalg.solve(factor, (points - centre).T).T

    factor = factor @ _lengthened(whitened(after))
    # Variances are told by few draws, correlations by many.
    z = whitened(after)
    scale = np.sqrt((len(z) * z.var(axis=0) + TRUST) / (len(z) + TRUST))
    trust = TRUST * inner.size
    covariance = (len(z) * np.cov((z / scale).T) + trust * np.eye(inner.size)) / (len(z) + trust)
    factor = _triangular(factor * scale @ np.linalg.cholesky(covariance))
    last = whitened(whole.reshape(*vectors.shape[:2], inner.size)[:, -1])
    middle = np.where(np.isin(np.arange(pooled.shape[1]), noise), white.centre, there.mean(axis=0))
    middle[inner] = centre
    fresh = white._replace(
        centre=jnp.asarray(middle),
        factor=jnp.asarray(factor),
        bend=bend,
        squeeze=squeeze,
        ridge=ridge,
        noise=_refit(white.noise, pooled[:, noise], trust),
        misfit=typical_misfit(pooled[:, noise], layout, data),
    )
    return fresh, last
