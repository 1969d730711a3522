"""Coordinates in which the posterior, the walled and the noise entries given, is nearly standard normal."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Float

from muscle_bayes.inference.bend import Bend, bent, unbent
from muscle_bayes.inference.bend_friction import FrictionScale
from muscle_bayes.inference.bend_hyst import Unbent
from muscle_bayes.inference.bend_sizes import Sizes
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.noise_moves import Proposal
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.proposed_move import ProposedMove
from muscle_bayes.inference.ridge import SHARE, Ridge, has_ridge, offer_along_ridge
from muscle_bayes.inference.squeeze import Squeeze, squeezed, unsqueezed
from muscle_bayes.inference.walled_moves import Table, WalledProposal, offer_walled


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
) -> ProposedMove:
    """A proposal for the walled entry `which`, alone or along its ridge."""
    key_kind, key_offer = jax.random.split(key)
    along = offer_along_ridge(key_offer, which, vector, white.ridge, white.bend, layout, data)
    alone = offer_walled(key_offer, which, vector, white.walled, data.tension, layout)
    chosen = has_ridge(white.ridge)[which] & (jax.random.uniform(key_kind) < SHARE)
    return jax.tree.map(lambda a, b: jnp.where(chosen, a, b), along, alone)


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
