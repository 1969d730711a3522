"""Coordinates in which the posterior, the walled and the noise entries given, is nearly standard normal."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Float

from muscle_bayes.inference.bend import Bend, bent, unbent
from muscle_bayes.inference.bend_friction import (
    FrictionScale,
    place_of_friction,
    scale_at_mode,
    scale_of_draws,
)
from muscle_bayes.inference.bend_hyst import Unbent
from muscle_bayes.inference.bend_sizes import Sizes, sizes_at_mode, sizes_of_draws
from muscle_bayes.inference.bent_rows import bent_rows, turn_at, unbent_rows, unscaled_rows
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.factored import FactoredPrecision
from muscle_bayes.inference.first_edges import Frame, squeeze_at
from muscle_bayes.inference.noise_moves import (
    Proposal,
    lasting_misfit,
    proposal_at_mode,
    reading_spacing,
    refit,
)
from muscle_bayes.inference.optimise import Mode
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.program import Program
from muscle_bayes.inference.programs import potential_at
from muscle_bayes.inference.ridge import (
    SHARE,
    Ridge,
    has_ridge,
    offer_along_ridge,
    ridge_of,
    scattered,
)
from muscle_bayes.inference.row_blocks import in_blocks
from muscle_bayes.inference.squeeze import Squeeze, squeezed, unsqueezed
from muscle_bayes.inference.walled_moves import (
    Table,
    WalledOffer,
    WalledProposal,
    offer_walled,
    tabulate,
)

EDGE_POINTS = 3
"""Points per coordinate by which edges of dead bands are first told."""
LONG = 2.5
"""Standard deviation of draws along a direction, in that of the whitening, from which on it is learned."""
TRUST = 20.0
"""Draws that the whitening at the mode counts for when it is rescaled."""


class Whitening(NamedTuple):
    """squeezed[smooth] = centre[smooth] + factor @ z: given the rest, nearly a standard normal in z."""

    centre: Float[Array, " n"]
    factor: Float[Array, "smooth smooth"]
    bend: Bend
    """What fixes bent coordinates."""
    squeeze: Squeeze
    """What fixes squeezed ones."""
    walled: WalledProposal
    ridge: Ridge
    noise: Proposal
    misfit: Float[Array, " regime"]
    """Typical `lasting_misfit`."""


def whitened(
    vector: Float[Array, " n"], white: Whitening, layout: Layout, data: Data
) -> Float[Array, " smooth"]:
    """z of an unconstrained vector."""
    there = squeezed(bent(vector, white.bend, layout, data), white.squeeze)
    return _whitened(there, white, layout)


def _whitened(there: Float[Array, " n"], white: Whitening, layout: Layout) -> Array:
    away = there - white.centre
    return solve_triangular(white.factor, away[blocks(layout).smooth], lower=True)


class Place(NamedTuple):
    """What z stands for."""

    point: Unbent
    x: Float[Array, " x"]
    """In coordinates in which predictions are nearly linear: whitened bent ones of the smooth entries, then
    bent walled ones above the centre."""


def placed(
    z: Float[Array, " smooth"],
    rest: Float[Array, " n"],
    white: Whitening,
    layout: Layout,
    data: Data,
) -> Place:
    """The point at z, given the other entries of bent coordinates (that squeezed ones share)."""
    inner = blocks(layout).smooth
    there = rest.at[inner].set(white.centre[inner] + white.factor @ z)
    there, log_volume = unsqueezed(there, white.squeeze)
    x = _straight(there, white, layout)
    vector, bent_volume = unbent(there, white.bend, layout, data)
    return Place(Unbent(vector, log_volume + bent_volume), x)


def straight(
    vector: Float[Array, " n"], white: Whitening, layout: Layout, data: Data
) -> Float[Array, " x"]:
    """x of an unconstrained vector, as `Place` has it."""
    return _straight(bent(vector, white.bend, layout, data), white, layout)


def _straight(there: Float[Array, " n"], white: Whitening, layout: Layout) -> Float[Array, " x"]:
    outer = blocks(layout).walled
    return jnp.concatenate([_whitened(there, white, layout), there[outer] - white.centre[outer]])


def offer(
    key: Array,
    which: Array,
    vector: Float[Array, " n"],
    white: Whitening,
    layout: Layout,
    data: Data,
) -> WalledOffer:
    """A proposal for the walled entry `which`, alone or along its ridge."""
    key_kind, key_offer = jax.random.split(key)
    along = offer_along_ridge(key_offer, which, vector, white.ridge, white.bend, layout, data)
    alone = offer_walled(key_offer, which, vector, white.walled, data.tension, layout)
    chosen = has_ridge(white.ridge)[which] & (jax.random.uniform(key_kind) < SHARE)
    return jax.tree.map(lambda a, b: jnp.where(chosen, a, b), along, alone)


@Program
def _misfits(
    noise: Float[Array, "row k"], layout: Layout, data: Data
) -> Float[Array, "row regime"]:
    spacing = reading_spacing(layout, data)
    return jax.vmap(lambda entries: lasting_misfit(entries, spacing))(noise)


def _typical_misfit(
    noise: Float[np.ndarray, "row k"], layout: Layout, data: Data
) -> Float[Array, " regime"]:
    return jnp.asarray(np.median(in_blocks(_misfits, noise, layout, data), axis=0))


_refit = Program(refit)


class _Bent(NamedTuple):
    """A most probable point in bent coordinates."""

    centre: Float[np.ndarray, " n"]
    information: Float[np.ndarray, "n n"]
    """Fisher information in them."""
    covariance: Float[np.ndarray, "smooth smooth"]
    """Of the smooth entries, the others given."""


def _at_mode(mode: Mode, bend: Bend, layout: Layout, data: Data) -> _Bent:
    inner = blocks(layout).smooth
    centre = bent_rows(np.asarray(mode.vector)[None], bend, layout, data)[0]
    turn = turn_at(centre, bend, layout, data)
    information = turn.T @ np.asarray(mode.information) @ turn
    told = FactoredPrecision(information[np.ix_(inner, inner)])
    return _Bent(centre, information, told.inverse())


def whitening(mode: Mode, layout: Layout, data: Data) -> Whitening:
    """Whitening by the Fisher information at the mode, given the walled and the noise entries."""
    inner, outer, noise = blocks(layout)
    vector = np.asarray(mode.vector)

    def energy_of(vector: Array) -> float:
        return potential_at(vector, layout, data)

    references, logs = unscaled_rows(vector[None], layout, data)
    friction = scale_at_mode(energy_of, mode.vector, float(references[0]), layout)
    bend = Bend(friction, Sizes.blank(layout))
    spread = np.ones(vector.size)
    spread[inner] = np.sqrt(np.diag(_at_mode(mode, bend, layout, data).covariance))
    bend = bend._replace(sizes=sizes_at_mode(logs[0], spread, layout))
    centre, information, covariance = _at_mode(mode, bend, layout, data)
    factor = np.linalg.cholesky(0.5 * (covariance + covariance.T))
    stride = 2.4 / np.sqrt(np.diag(information)[outer])
    proposal = proposal_at_mode(vector[noise], np.asarray(mode.information)[np.ix_(noise, noise)])
    misfit = _typical_misfit(vector[noise][None], layout, data)
    table = tabulate(energy_of, mode.vector, layout, data)
    walled = WalledProposal(jnp.asarray(stride), table)
    ridge = ridge_of(centre[outer], FactoredPrecision(information).inverse()[outer], layout)
    frame = Frame(centre, factor, inner, outer)
    points = np.tile(centre, (1 + EDGE_POINTS * inner.size, 1))
    rng = np.random.default_rng(0)
    points[1:, inner] += rng.standard_normal((len(points) - 1, inner.size)) @ factor.T
    points[1:] = scattered(points[1:], ridge, rng)
    vectors = unbent_rows(points, bend, layout, data)
    squeeze = squeeze_at(frame.of(points), vectors, frame, layout, data)
    middle = squeezed(jnp.asarray(centre), squeeze)
    return Whitening(middle, jnp.asarray(factor), bend, squeeze, walled, ridge, proposal, misfit)


def blank(layout: Layout) -> Whitening:
    """A whitening of the layout's shapes that holds nothing."""
    inner, outer, noise = blocks(layout)
    size = inner.size + outer.size + noise.size
    walled = WalledProposal(jnp.zeros(outer.size), Table.empty(layout))
    proposal = Proposal(jnp.zeros(noise.size), jnp.eye(noise.size))
    bend = Bend(FrictionScale(jnp.ones(()), jnp.zeros(())), Sizes.blank(layout))
    misfit = jnp.zeros(noise.size // 3)
    centre, factor = jnp.zeros(size), jnp.eye(inner.size)
    squeeze, ridge = Squeeze.none(layout), Ridge.none(layout)
    return Whitening(centre, factor, bend, squeeze, walled, ridge, proposal, misfit)


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
        misfit=_typical_misfit(pooled[:, noise], layout, data),
    )
    return fresh, last
