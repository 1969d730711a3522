"""Moves of noise and minimum forces that carry the smooth entries to where these then are probable."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Float

from muscle_bayes.inference.bend_walls import bent_walls
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.density import constrain, log_prior_entries, potential_given
from muscle_bayes.inference.noise_moves import (
    LOCAL_SHARE,
    around,
    candidates,
    entries_of,
    shape_of,
)
from muscle_bayes.inference.normal_equations import Linear, normal_equations, shown
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.proposed_move import ProposedMove
from muscle_bayes.inference.ridge import WIDER, has_ridge
from muscle_bayes.inference.surrogate import Surrogate
from muscle_bayes.inference.whitening import Whitening, placed, whitened

CANDIDATES = 4
"""Proposals per move."""
FORCED = 0.5
"""Share of moves in which a minimum force that has a ridge is drawn anew as well."""


class _Held(NamedTuple):
    """What decides where the smooth entries lie."""

    shape: Float[Array, " k"]
    """Of the noise."""
    walled: Float[Array, " walled"]
    """Minimum forces, bent."""


class _Given(NamedTuple):
    """What the smooth entries nearly are: z = middle + factor^-T u, u standard normal."""

    middle: Float[Array, " smooth"]
    factor: Float[Array, "smooth smooth"]
    """Lower triangular, of the precision."""


class _Candidate(NamedTuple):
    vector: Float[Array, " n"]
    energy: Float[Array, ""]
    """Negative log density by the surrogate."""
    log_weight: Float[Array, ""]
    """Log of target over proposal, volumes counted."""


def _candidates(
    key: Array, here: _Held, white: Whitening
) -> tuple[_Held, Float[Array, " candidate"]]:
    """Here and others, and the log density of each as a proposal."""
    key_local, key_shape, key_walled, key_coin = jax.random.split(key, 4)
    local = jax.random.uniform(key_local) < LOCAL_SHARE
    shape = candidates(key_shape, here.shape, white.noise, local, CANDIDATES)
    ridge = white.ridge
    moved = has_ridge(ridge) & (jax.random.uniform(key_coin, here.walled.shape) < FORCED)
    wide = jnp.where(moved, WIDER * ridge.spread, 0.0)
    near = around(key_walled, here.walled, jnp.diag(wide), CANDIDATES).point
    fresh = jax.random.normal(key_walled, (CANDIDATES, here.walled.size))
    far = jnp.concatenate([here.walled[None], ridge.middle + wide * fresh])
    walled = jnp.where(moved, jnp.where(local, near, far), here.walled)
    away = jnp.where(moved & ~local, (walled - ridge.middle) / jnp.where(moved, wide, 1.0), 0.0)
    log_density = shape.log_density - 0.5 * jnp.sum(away**2, axis=1)
    return _Held(shape.point, walled), log_density


def offer_carried(
    key: Array,
    vector: Float[Array, " n"],
    white: Whitening,
    surrogate: Surrogate,
    layout: Layout,
    data: Data,
) -> ProposedMove:
    """Noise and minimum forces drawn anew by the surrogate, the smooth entries carried along.

    Where misfit is small smooth entries are known well, and forces only together with them: either
    held, the other moves little. So u = factor' (z - middle) is held, with middle and precision =
    factor factor' those of generalised least squares, which noise and forces decide (a partially
    non-centred parameterisation: Papaspiliopoulos, Roberts and Sköld, Statistical Science 22, 2007).
    The present point and CANDIDATES others are weighted by target / proposal and one is chosen, as in
    `move_noise`. By the surrogate's density that leads from one end to the other as often as back: its
    odds are taken off, for the simulation to judge (see `chained`).
    """
    _, outer, noise = blocks(layout)
    key_points, key_choice = jax.random.split(key)
    z = whitened(vector, white, layout, data)
    origin = jnp.zeros_like(z)
    here = _Held(shape_of(vector[noise]), bent_walls(vector, layout, data)[outer])
    held, log_proposal = _candidates(key_points, here, white)

    def rest_of(held: _Held) -> Array:
        return vector.at[outer].set(held.walled).at[noise].set(entries_of(held.shape))

    def model(z: Array, rest: Array) -> tuple[list[Array], Array]:
        point, x = placed(z, rest, white, layout, data)
        values = constrain(point.vector, layout, data)
        return shown(surrogate.at(x), values, layout, data), point.vector

    # All but noise and forces is looked at amid the whitening, and slopes are taken for those there.
    amid = rest_of(_Held(here.shape, white.centre[outer]))
    predicted = surrogate.at(placed(origin, amid, white, layout, data).x)
    middle, (slopes, turn) = model(origin, amid)[1], jax.jacfwd(model)(origin, amid)

    def along_entries(vector: Array) -> Array:
        return jax.grad(lambda v: jnp.sum(log_prior_entries(v, layout, data)))(vector)

    slope, bend = jax.jvp(along_entries, (middle,), (jnp.ones_like(middle),))
    prior_pull = slope @ turn
    prior_precision = turn.T @ (jnp.maximum(-bend, 0.0)[:, None] * turn)

    def given(held: _Held) -> _Given:
        rest = rest_of(held)
        readings, there = model(origin, rest)
        linear = [Linear(*one) for one in zip(readings, slopes, predicted, strict=True)]
        told = normal_equations(linear, constrain(there, layout, data), layout, data)
        factor = jnp.linalg.cholesky(told.information + prior_precision)
        half = solve_triangular(factor, told.pull + prior_pull, lower=True)
        return _Given(solve_triangular(factor, half, lower=True, trans=1), factor)

    all_given = jax.vmap(given)(held)
    u = all_given.factor[0].T @ (z - all_given.middle[0])

    def candidate(held: _Held, given: _Given, log_proposal: Array) -> _Candidate:
        there = given.middle + solve_triangular(given.factor, u, lower=True, trans=1)
        point, x = placed(there, rest_of(held), white, layout, data)
        energy = potential_given(surrogate.at(x), point.vector, layout, data)
        log_volume = point.log_volume - jnp.sum(jnp.log(jnp.diag(given.factor)))
        weight = log_volume - energy - log_proposal
        return _Candidate(point.vector, energy, jnp.where(jnp.isnan(weight), -jnp.inf, weight))

    found = jax.vmap(candidate)(held, all_given, log_proposal)
    chosen = jax.random.categorical(key_choice, found.log_weight)
    # The present point as it is, not as rounding in two changes of coordinates leaves it.
    end = jnp.where(chosen == 0, vector, found.vector[chosen])
    return ProposedMove(end, found.energy[chosen] - found.energy[0])
