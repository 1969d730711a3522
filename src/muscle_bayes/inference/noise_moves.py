"""Draws of the noise parameters given a simulation: iterated importance resampling."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.density import potential_given
from muscle_bayes.inference.lane_model import LanePrediction
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.program import Program

FREEDOM = 5
"""Degrees of freedom of the proposal: tails heavier than the target's."""
WIDENING = 1.3
"""Factor on the standard deviations of what was learned: too wide costs little, too narrow much."""
WIDE, WIDE_SHARE = 4.0, 0.2
"""Scale and share of the proposal's wide part, for tails that were not seen."""
CANDIDATES = 32
"""Proposals per move."""
LOCAL_SHARE = 0.3
"""Of moves, those whose candidates lie around the present point: in tails few others do."""
SHORTEST = 0.1
"""Least standard deviation of their distance, in that of the proposal, which is the greatest."""


class Proposal(NamedTuple):
    """Mixture of two multivariate Student t, one of them wide, over `shape_of` the noise entries."""

    centre: Float[Array, " k"]
    factor: Float[Array, "k k"]
    """Lower triangular, of the narrow part's scale matrix."""


def shape_of(entries: Float[Array, " k"]) -> Float[Array, " k"]:
    """(log total, logit of the discrepancy's share of variance, log correlation time) of each regime.

    The data tell the total well and, where the discrepancy is short-lived, its share hardly: in
    these coordinates the density is far less curved than in log noise and log discrepancy. The map
    has the constant Jacobian determinant 2 per regime, so densities need no correction.
    """
    noise, discrepancy, time = entries.reshape(-1, 3).T
    total = 0.5 * jnp.logaddexp(2.0 * noise, 2.0 * discrepancy)
    return jnp.stack([total, 2.0 * (discrepancy - noise), time], 1).ravel()


def entries_of(shape: Float[Array, " k"]) -> Float[Array, " k"]:
    """Inverse of `shape_of`."""
    total, odds, time = shape.reshape(-1, 3).T
    noise = total + 0.5 * jax.nn.log_sigmoid(-odds)
    return jnp.stack([noise, total + 0.5 * jax.nn.log_sigmoid(odds), time], 1).ravel()


def _sample(key: Array, proposal: Proposal, count: int) -> Float[Array, "count k"]:
    key_normal, key_mixing, key_wide = jax.random.split(key, 3)
    normal = jax.random.normal(key_normal, (count, proposal.centre.size))
    mixing = jnp.mean(jax.random.normal(key_mixing, (count, FREEDOM)) ** 2, axis=1, keepdims=True)
    wide = jnp.where(jax.random.bernoulli(key_wide, WIDE_SHARE, (count, 1)), WIDE, 1.0)
    return proposal.centre + (wide * normal / jnp.sqrt(mixing)) @ proposal.factor.T


def _log_density(point: Float[Array, " k"], proposal: Proposal) -> Float[Array, ""]:
    """Of the proposal, up to a constant that changes with its factor."""
    z = jax.scipy.linalg.solve_triangular(proposal.factor, point - proposal.centre, lower=True)
    size = proposal.centre.size

    def part(share: float, scale: float) -> Array:
        tail = jnp.log1p(z @ z / (scale**2 * FREEDOM))
        return jnp.log(share) - size * jnp.log(scale) - 0.5 * (FREEDOM + size) * tail

    return jnp.logaddexp(part(1.0 - WIDE_SHARE, 1.0), part(WIDE_SHARE, WIDE))


class Candidates(NamedTuple):
    """Points of which one is chosen, the present one first."""

    point: Float[Array, "candidate k"]
    log_density: Float[Array, " candidate"]
    """Log density of each as a proposal, up to a constant."""


def around(
    key: Array, here: Float[Array, " k"], factor: Float[Array, "k k"], count: int
) -> Candidates:
    """Draws about a centre that is itself drawn about the present point, all alike.

    Given the centre the present point is one of them, whichever it is: none is more of a proposal
    than another (Tjelmeland, Preprint Statistics 4, NTNU Trondheim, 2004).
    """
    key_scale, key_centre, key_points = jax.random.split(key, 3)
    scale = SHORTEST ** jax.random.uniform(key_scale)
    centre = here + scale * factor @ jax.random.normal(key_centre, here.shape)
    points = centre + scale * jax.random.normal(key_points, (count, here.size)) @ factor.T
    return Candidates(jnp.concatenate([here[None], points]), jnp.zeros(1 + count))


def candidates(
    key: Array, here: Float[Array, " k"], proposal: Proposal, local: Array, count: int
) -> Candidates:
    """Draws of the proposal, or, if `local`, around the present shape."""
    near = around(key, here, proposal.factor, count)
    points = jnp.concatenate([here[None], _sample(key, proposal, count)])
    far = Candidates(points, jax.vmap(lambda point: _log_density(point, proposal))(points))
    return jax.tree.map(lambda a, b: jnp.where(local, a, b), near, far)


def refit(proposal: Proposal, draws: Float[Array, "draw k"], trust: float) -> Proposal:
    """The proposal moved and widened to draws of the noise entries.

    `trust` is the number of draws that the proposal counts for.
    """
    points = jax.vmap(shape_of)(draws)
    share = len(points) / (len(points) + trust)
    centre = proposal.centre + share * (jnp.mean(points, axis=0) - proposal.centre)
    covariance = WIDENING**2 * jnp.atleast_2d(jnp.cov(points.T))
    covariance = share * covariance + (1.0 - share) * proposal.factor @ proposal.factor.T
    return Proposal(centre, jnp.linalg.cholesky(covariance))


def reading_spacing(layout: Layout, data: Data) -> Float[Array, " regime"]:
    """Mean time between readings of each regime, s."""
    names = list(dict.fromkeys(layout.regimes))
    time, readings = (jnp.zeros(len(names)) for _ in range(2))
    for lanes, name in zip(data.lanes, layout.regimes, strict=True):
        which = names.index(name)
        time = time.at[which].add(jnp.sum(lanes.time[:, -1] - lanes.time[:, 0]))
        readings = readings.at[which].add(jnp.sum(lanes.weight))
    return time / readings


def lasting_misfit(
    entries: Float[Array, " k"], spacing: Float[Array, " regime"]
) -> Float[Array, " regime"]:
    """Log size of each regime's misfit at low frequency.

    Half the log of its power there, discrepancy^2 correlation_time + noise^2 spacing / 2. Other
    parameters are known the better the smaller it is.
    """
    noise, discrepancy, time = entries.reshape(-1, 3).T
    white = 2.0 * noise + jnp.log(0.5 * spacing)
    return 0.5 * jnp.logaddexp(2.0 * discrepancy + time, white)


def disperse(key: Array, vector: Array, proposal: Proposal, layout: Layout) -> Float[Array, " n"]:
    """The vector with its noise entries drawn from the normal part of the proposal."""
    kicks = jax.random.normal(key, proposal.centre.shape)
    shape = proposal.centre + proposal.factor @ kicks
    return vector.at[blocks(layout).noise].set(entries_of(shape))


@Program
def _shape_and_turn(
    entries: Float[Array, " k"],
) -> tuple[Float[Array, " k"], Float[Array, "k k"]]:
    shape = shape_of(entries)
    return shape, jax.jacfwd(entries_of)(shape)


def proposal_at_mode(
    entries: Float[np.ndarray, " k"], information: Float[np.ndarray, "k k"]
) -> Proposal:
    """The proposal from the most probable noise entries and their Fisher information, the rest given."""
    shape, turn = map(np.asarray, _shape_and_turn(jnp.asarray(entries)))
    covariance = WIDENING**2 * np.linalg.inv(turn.T @ information @ turn)
    return Proposal(jnp.asarray(shape), jnp.asarray(np.linalg.cholesky(covariance)))


class _Weighed(NamedTuple):
    """Shapes of the noise, judged with the rest of the vector held."""

    energy: Float[Array, " count"]
    """Negative log density."""
    log_weight: Float[Array, " count"]
    """Log of target over proposal."""


def _weighed(
    tried: Candidates,
    predicted: list[LanePrediction],
    vector: Array,
    layout: Layout,
    data: Data,
) -> _Weighed:
    entries = blocks(layout).noise

    def one(point: Array, log_density: Array) -> _Weighed:
        energy = potential_given(predicted, vector.at[entries].set(entries_of(point)), layout, data)
        weight = -energy - log_density
        return _Weighed(energy, jnp.where(jnp.isnan(weight), -jnp.inf, weight))

    return jax.vmap(one)(*tried)


class NoiseMove(NamedTuple):
    """Where a move of the noise ends."""

    vector: Float[Array, " n"]
    """Unconstrained."""
    energy: Float[Array, ""]
    """Negative log density there."""


def move_noise(
    key: Array,
    predicted: list[LanePrediction],
    vector: Array,
    proposal: Proposal,
    layout: Layout,
    data: Data,
) -> NoiseMove:
    """The vector with its noise entries drawn anew; `predicted` are its predictions.

    The present entries and CANDIDATES others, draws of the proposal or around the present ones, are
    weighted by target / proposal and one is chosen (iterated sampling importance resampling; Andrieu,
    Lee & Vihola, Bernoulli 24, 2018): the target stays invariant, whatever the proposal.
    """
    entries = blocks(layout).noise
    key_local, key_points, key_choice = jax.random.split(key, 3)
    local = jax.random.uniform(key_local) < LOCAL_SHARE
    tried = candidates(key_points, shape_of(vector[entries]), proposal, local, CANDIDATES)
    weighed = _weighed(tried, predicted, vector, layout, data)
    chosen = jax.random.categorical(key_choice, weighed.log_weight)
    moved = vector.at[entries].set(entries_of(tried.point[chosen]))
    return NoiseMove(moved, weighed.energy[chosen])
