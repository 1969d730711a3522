"""Coordinates in which the posterior, the walled and the noise entries given, is nearly standard normal."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Float

from muscle_bayes.inference.bend import Bend, bent, bent_smooth, logs_of, unbent
from muscle_bayes.inference.bend_friction import (
    FrictionScale,
    scale_at_mode,
    scale_of_draws,
)
from muscle_bayes.inference.bend_sizes import Sizes, sizes_at_mode, sizes_of_draws
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.noise_moves import (
    Proposal,
    adapt,
    entries_of,
    lasting_misfit,
    reading_spacing,
    refit,
)
from muscle_bayes.inference.optimise import Mode
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.program import Program
from muscle_bayes.inference.programs import potential_at, predictions_at
from muscle_bayes.inference.row_blocks import in_blocks
from muscle_bayes.inference.walled_moves import Table, WalledProposal, tabulate

TRUST = 20.0
"""Draws that the whitening at the mode counts for when it is rescaled."""
NOISE_SPREAD = 0.7
"""Standard deviation of the unconstrained noise parameters from which their proposal is adapted."""


class Whitening(NamedTuple):
    """bent[smooth] = centre[smooth] + factor @ z: given the rest, nearly a standard normal in z."""

    centre: Float[Array, " n"]
    factor: Float[Array, "smooth smooth"]
    bend: Bend
    """What fixes bent coordinates."""
    walled: WalledProposal
    noise: Proposal
    misfit: Float[Array, " regime"]
    """Typical `lasting_misfit`."""


def whitened(
    vector: Float[Array, " n"], white: Whitening, layout: Layout, data: Data
) -> Float[Array, " smooth"]:
    """z of an unconstrained vector."""
    away = bent_smooth(vector, white.bend, layout, data) - white.centre
    return solve_triangular(white.factor, away[blocks(layout).smooth], lower=True)


@Program
def _bent_draws(vectors: Array, bend: Bend, layout: Layout, data: Data) -> Float[Array, "draw n"]:
    return jax.vmap(lambda vector: bent(vector, bend, layout, data))(vectors)


@Program
def _bend_of_draws(draws: Float[Array, "draw n"], layout: Layout, data: Data) -> Bend:
    bend = Bend(scale_of_draws(draws, layout, data), Sizes.blank(layout))
    logs = jax.vmap(lambda vector: logs_of(vector, bend, layout, data))(draws)
    return bend._replace(sizes=sizes_of_draws(logs, layout))


@Program
def _typical_misfit(
    noise: Float[Array, "draw k"], layout: Layout, data: Data
) -> Float[Array, " regime"]:
    spacing = reading_spacing(layout, data)
    return jnp.median(jax.vmap(lambda entries: lasting_misfit(entries, spacing))(noise), axis=0)


_entries_of, _refit = Program(entries_of), Program(refit)


@Program
def _turn(centre: Array, bend: Bend, layout: Layout, data: Data) -> Float[Array, "n n"]:
    """Derivative of the unconstrained vector in bent coordinates."""
    return jax.jacfwd(lambda point: unbent(point, bend, layout, data).vector)(centre)


@Program
def _logs(vector: Array, bend: Bend, layout: Layout, data: Data) -> Array:
    return logs_of(vector, bend, layout, data)


_sizes_at_mode = Program(sizes_at_mode)


def _at_mode(
    mode: Mode, bend: Bend, layout: Layout, data: Data
) -> tuple[Array, Float[np.ndarray, "n n"], Float[np.ndarray, "smooth smooth"]]:
    """Bent coordinates of the mode, Fisher information in them, and covariance of the smooth ones."""
    inner = blocks(layout).smooth
    centre = jnp.asarray(
        in_blocks(_bent_draws, np.asarray(mode.vector)[None], bend, layout, data)[0]
    )
    turn = _turn(centre, bend, layout, data)
    information = np.asarray(turn.T @ mode.information @ turn)
    return centre, information, np.linalg.inv(information[np.ix_(inner, inner)])


def whitening(key: Array, mode: Mode, layout: Layout, data: Data) -> Whitening:
    """Whitening by the Fisher information at the mode, given the walled and the noise entries."""
    inner, outer, noise = blocks(layout)

    def energy_of(vector: Array) -> float:
        return potential_at(vector, layout, data)

    friction = scale_at_mode(energy_of, mode.vector, layout, data)
    bend = Bend(friction, Sizes.blank(layout))
    _, _, covariance = _at_mode(mode, bend, layout, data)
    spread = np.ones(mode.vector.size)
    spread[inner] = np.sqrt(np.diag(covariance))
    logs = _logs(mode.vector, bend, layout, data)
    bend = bend._replace(sizes=_sizes_at_mode(logs, spread, layout))
    centre, information, covariance = _at_mode(mode, bend, layout, data)
    factor = np.linalg.cholesky(0.5 * (covariance + covariance.T))
    stride = 2.4 / np.sqrt(np.diag(information)[outer])
    predicted = predictions_at(mode.vector, layout, data)
    proposal = adapt(key, predicted, mode.vector, NOISE_SPREAD * jnp.ones(noise.size), layout, data)
    misfit = _typical_misfit(_entries_of(proposal.centre)[None], layout, data)
    table = tabulate(energy_of, mode.vector, layout, data)
    walled = WalledProposal(jnp.asarray(stride), table)
    return Whitening(centre, jnp.asarray(factor), bend, walled, proposal, misfit)


def blank(layout: Layout) -> Whitening:
    """A whitening of the layout's shapes that holds nothing."""
    inner, outer, noise = blocks(layout)
    size = inner.size + outer.size + noise.size
    walled = WalledProposal(jnp.zeros(outer.size), Table.empty(layout))
    proposal = Proposal(jnp.zeros(noise.size), jnp.eye(noise.size))
    bend = Bend(FrictionScale(jnp.ones(()), jnp.zeros(())), Sizes.blank(layout))
    misfit = jnp.zeros(noise.size // 3)
    return Whitening(jnp.zeros(size), jnp.eye(inner.size), bend, walled, proposal, misfit)


def rewhiten(
    white: Whitening,
    vectors: Float[np.ndarray, "chain draw n"],
    layout: Layout,
    data: Data,
) -> tuple[Whitening, Float[np.ndarray, "chain smooth"]]:
    """A whitening by the covariance of draws as well, and the last draws in it.

    The Fisher information at the mode tells little where the data tell little.
    """
    inner, _, noise = blocks(layout)
    pooled = vectors.reshape(-1, vectors.shape[-1])
    bend = _bend_of_draws(pooled, layout, data)
    before, after = (
        in_blocks(_bent_draws, pooled, one, layout, data)[:, inner] for one in (white.bend, bend)
    )
    # Rows whose coordinate has changed.
    stretch = after.std(axis=0) / before.std(axis=0)
    centre, factor = after.mean(axis=0), np.asarray(white.factor) * stretch[:, None]

    def whitened(points: np.ndarray) -> np.ndarray:
        return np.linalg.solve(factor, (points - centre).T).T

    # Variances are told by few draws, correlations by many.
    z = whitened(after)
    scale = np.sqrt((len(z) * z.var(axis=0) + TRUST) / (len(z) + TRUST))
    trust = TRUST * inner.size
    covariance = (len(z) * np.cov((z / scale).T) + trust * np.eye(inner.size)) / (len(z) + trust)
    factor = factor * scale @ np.linalg.cholesky(covariance)
    last = whitened(after.reshape(*vectors.shape[:2], inner.size)[:, -1])
    whole = np.array(white.centre)
    whole[inner] = centre
    fresh = white._replace(
        centre=jnp.asarray(whole),
        factor=jnp.asarray(factor),
        bend=bend,
        noise=_refit(white.noise, pooled[:, noise], trust),
        misfit=_typical_misfit(pooled[:, noise], layout, data),
    )
    return fresh, last
