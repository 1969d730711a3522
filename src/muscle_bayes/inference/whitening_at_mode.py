"""The whitening that the Fisher information at the most probable point gives."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.bend import Bend
from muscle_bayes.inference.bend_friction import scale_at_mode
from muscle_bayes.inference.bend_sizes import Sizes, sizes_at_mode
from muscle_bayes.inference.bent_rows import bent_rows, turn_at, unbent_rows, unscaled_rows
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.factored import FactoredPrecision
from muscle_bayes.inference.first_edges import Frame, squeeze_at
from muscle_bayes.inference.mode import Mode
from muscle_bayes.inference.noise_moves import proposal_at_mode
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.programs import potential_at
from muscle_bayes.inference.ridge import ridge_of, scattered
from muscle_bayes.inference.squeeze import squeezed
from muscle_bayes.inference.typical_misfit import typical_misfit
from muscle_bayes.inference.walled_moves import WalledProposal, tabulate
from muscle_bayes.inference.whitening import Whitening

EDGE_POINTS = 3
"""Points per coordinate by which edges of dead bands are first told."""


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
    misfit = typical_misfit(vector[noise][None], layout, data)
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
