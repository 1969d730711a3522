"""One chain's transitions along a surrogate: a simulation judges where a trajectory ends.

The surrogate's Hamiltonian is followed, which keeps volume and can be run backwards whatever the
surrogate, and the end accepted by the model's own energy (Rasmussen, Bayesian Statistics 7, 2003): draws
are of the model's posterior. No derivative of the simulation is needed.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from muscle_bayes.inference.bend_hyst import Unbent
from muscle_bayes.inference.bend_walls import bent_walls
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.carried_moves import offer_carried
from muscle_bayes.inference.chained_moves import chained
from muscle_bayes.inference.dead_bands import START
from muscle_bayes.inference.density import constrain, potential_given
from muscle_bayes.inference.kernel import (
    ADAPTATION,
    ADAPTED_STEPS,
    CHUNK,
    LARGEST_RISE,
    LONGEST_TRAJECTORY,
    MOST_STEPS,
    SHORTEST_STEP,
    SHORTEST_TRAJECTORY,
    Kernel,
    Transition,
)
from muscle_bayes.inference.lane_model import LanePrediction, predictions
from muscle_bayes.inference.noise_moves import disperse, lasting_misfit, move_noise, reading_spacing
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.proposed_move import ProposedMove
from muscle_bayes.inference.ridge import SHARE, has_ridge, offer_along_ridge
from muscle_bayes.inference.start_moves import has_edges, offer_start
from muscle_bayes.inference.surrogate import Surrogate
from muscle_bayes.inference.walled_moves import offer_walled
from muscle_bayes.inference.whitening import Whitening, placed, straight, whitened

CARRYING = 0.5
"""Share of iterations with a carried move."""
TARGET_ACCEPTANCE = 0.9
"""Of trajectories by the surrogate's own energy: steps cost little."""
RIDGE_STEPS = 10
"""Moves along a ridge of which the last is judged by a simulation."""


class GuidedState(NamedTuple):
    """Where a chain is."""

    vector: Float[Array, " n"]
    """Unconstrained."""
    predicted: list[LanePrediction]
    """Predictions there."""
    key: Array
    adaptation: Any
    """Of the logarithm of the leapfrog step, by dual averaging."""


class _Here(NamedTuple):
    """A point of the model."""

    vector: Float[Array, " n"]
    energy: Float[Array, ""]
    """Negative log density of the vector."""
    predicted: list[LanePrediction]


class _Told(NamedTuple):
    """What an iteration tells of its trajectory."""

    energy: Float[Array, ""]
    """Potential and kinetic, at its start."""
    rise: Float[Array, ""]
    """Of the energy by the surrogate."""
    steps: Int[Array, ""]
    acceptance: Float[Array, ""]


class _Offer(NamedTuple):
    """A vector to move to, from one whose energy is known."""

    here: _Here
    there: Float[Array, " n"]
    log_odds: Float[Array, ""]
    """Added to the fall of the energy: what else decides whether the offer is taken."""
    told: _Told


class _Moving(NamedTuple):
    z: Float[Array, " smooth"]
    momentum: Float[Array, " smooth"]
    gradient: Float[Array, " smooth"]
    begun: Float[Array, ""]
    """Energy by the surrogate at the start."""
    energy: Float[Array, ""]
    """The same here."""
    begun_log_volume: Float[Array, ""]
    point: Unbent
    """What z stands for."""


@lru_cache(maxsize=32)
def guided_kernel_of(layout: Layout) -> Kernel:
    """Kernel of a layout, not compiled."""
    inner, outer, noise = blocks(layout)
    names = dict(layout.shapes)

    def simulate(vector: Array, data: Data) -> list[LanePrediction]:
        return predictions(constrain(vector, layout, data), layout, data)

    def start(key: Array, white: Whitening, data: Data) -> GuidedState:
        key_z, key_noise, key_rest = jax.random.split(key, 3)
        z = jax.random.normal(key_z, (inner.size,))
        point = placed(z, white.centre, white, layout, data).point
        vector = disperse(key_noise, point.vector, white.noise, layout)
        shapes = jax.eval_shape(simulate, vector, data)
        nothing = jax.tree.map(lambda one: jnp.zeros(one.shape, one.dtype), shapes)
        return GuidedState(vector, nothing, key_rest, ADAPTATION[0]())

    def by_trajectory(
        key: Array, here: _Here, white: Whitening, surrogate: Surrogate, data: Data, step: Array
    ) -> _Offer:
        """The noise drawn anew, then a trajectory along the surrogate."""
        key_length, key_noise, key_momentum = jax.random.split(key, 3)
        moved = move_noise(key_noise, here.predicted, here.vector, white.noise, layout, data)
        here = _Here(moved.vector, moved.energy, here.predicted)
        # While the smooth entries move, the walled ones keep their distance from walls.
        rest = here.vector.at[outer].set(bent_walls(here.vector, layout, data)[outer])

        def along(z: Array) -> tuple[Array, Unbent]:
            point, x = placed(z, rest, white, layout, data)
            predicted = surrogate.at(x)
            return potential_given(predicted, point.vector, layout, data) - point.log_volume, point

        span = LONGEST_TRAJECTORY - SHORTEST_TRAJECTORY
        length = SHORTEST_TRAJECTORY + span * jax.random.uniform(key_length)
        # Where misfit is small the others are known well: steps right elsewhere go astray there.
        spacing = reading_spacing(layout, data)
        misfit = jnp.exp(jnp.min(lasting_misfit(rest[noise], spacing) - white.misfit))
        short = step * jnp.clip(misfit, SHORTEST_STEP, 1.0)
        count = jnp.clip(jnp.ceil(length / short), 1, MOST_STEPS).astype(int)
        stride = jnp.minimum(length / count, short)

        # One loop, for a program that looks at the energy in one place compiles sooner.
        def leap(index: Array, now: _Moving) -> _Moving:
            half = now.momentum - 0.5 * stride * now.gradient
            first = index == 0
            z = jnp.where(first, now.z, now.z + stride * half)
            (energy, point), gradient = jax.value_and_grad(along, has_aux=True)(z)
            momentum = jnp.where(first, now.momentum, half - 0.5 * stride * gradient)
            return _Moving(
                z,
                momentum,
                gradient,
                jnp.where(first, energy, now.begun),
                energy,
                jnp.where(first, point.log_volume, now.begun_log_volume),
                point,
            )

        z = whitened(here.vector, white, layout, data)
        momentum = jax.random.normal(key_momentum, z.shape)
        none = jnp.zeros(())
        point = Unbent(here.vector, none)
        begin = _Moving(z, momentum, jnp.zeros_like(z), none, none, none, point)
        ended = jax.lax.fori_loop(0, count + 1, leap, begin)
        kinetic, kinetic_ended = (0.5 * one @ one for one in (momentum, ended.momentum))
        told = _Told(
            energy=here.energy - ended.begun_log_volume + kinetic,
            rise=_or_infinite(ended.energy + kinetic_ended - ended.begun - kinetic),
            steps=count,
            acceptance=none,
        )
        log_odds = ended.point.log_volume - ended.begun_log_volume + kinetic - kinetic_ended
        return _Offer(here, ended.point.vector, log_odds, told)

    def by_ridge(
        key: Array, which: Array, here: _Here, white: Whitening, surrogate: Surrogate, data: Data
    ) -> ProposedMove:
        """Moves of a walled entry along its ridge by the surrogate."""

        def energy(vector: Array) -> Array:
            predicted = surrogate.at(straight(vector, white, layout, data))
            return _or_infinite(potential_given(predicted, vector, layout, data))

        def along(key: Array, vector: Array) -> ProposedMove:
            return offer_along_ridge(key, which, vector, white.ridge, white.bend, layout, data)

        return chained(key, here.vector, energy, along, RIDGE_STEPS)

    def iterate(
        state: GuidedState, white: Whitening, surrogate: Surrogate, data: Data, step: Array
    ) -> tuple[GuidedState, Transition]:
        key, key_moves, key_carry = jax.random.split(state.key, 3)
        adapting = jnp.clip(jnp.exp(state.adaptation[0]), *ADAPTED_STEPS)
        step = jnp.where(step > 0.0, step, adapting)
        edges = white.squeeze
        carrying = jax.random.uniform(key_carry) < CARRYING
        last = 1 + outer.size + jnp.where(has_edges(edges), 1, 0) + jnp.where(carrying, 1, 0)

        # First a trajectory, then each walled entry, then a start if any lies at an edge, and at times a
        # carried move. One loop: a program that simulates in one place compiles sooner.
        def move(index: Array, now: tuple[_Here, _Told]) -> tuple[_Here, _Told]:
            here, told = now
            key_offer, key_accept = jax.random.split(jax.random.fold_in(key_moves, index))

            def trajectory() -> _Offer:
                return by_trajectory(key_offer, here, white, surrogate, data, step)

            def walled() -> _Offer:
                key_kind, key_made = jax.random.split(key_offer)
                which = index - 1

                def along() -> ProposedMove:
                    return by_ridge(key_made, which, here, white, surrogate, data)

                def alone() -> ProposedMove:
                    walled = white.walled
                    return offer_walled(key_made, which, here.vector, walled, data.tension, layout)

                told_together = has_ridge(white.ridge)[which]
                chosen = told_together & (jax.random.uniform(key_kind) < SHARE)
                made = jax.lax.cond(chosen, along, alone)
                return _Offer(here, made.vector, made.log_odds, told)

            def carried() -> _Offer:
                made = offer_carried(key_offer, here.vector, white, surrogate, layout, data)
                return _Offer(here, made.vector, made.log_odds, told)

            def begun() -> _Offer:
                return _Offer(here, *offer_start(key_offer, here.vector, edges, layout, data), told)

            kinds = [trajectory, carried, *[walled] * bool(outer.size), *[begun] * (START in names)]
            kind = jnp.where(index > outer.size, len(kinds) - 1, jnp.where(index > 0, 2, 0))
            kind = jnp.where((index == last - 1) & carrying, 1, kind)
            made = jax.lax.switch(kind, kinds)
            found = simulate(made.there, data)
            there = _Here(made.there, potential_given(found, made.there, layout, data), found)
            rise = _or_infinite(there.energy - made.here.energy - made.log_odds)
            acceptance = jnp.exp(jnp.minimum(-rise, 0.0))
            accepted = jax.random.uniform(key_accept) < acceptance
            here = jax.tree.map(lambda a, b: jnp.where(accepted, a, b), there, made.here)
            judged = jnp.where(index == 0, acceptance, told.acceptance)
            return here, made.told._replace(acceptance=judged)

        none = jnp.zeros(())
        first = _Here(state.vector, none, state.predicted)
        here, told = jax.lax.fori_loop(
            0, last, move, (first, _Told(none, none, jnp.asarray(0), none))
        )
        adaptation = ADAPTATION[1](
            TARGET_ACCEPTANCE - jnp.exp(jnp.minimum(-told.rise, 0.0)), state.adaptation
        )
        kept = Transition(
            here.vector,
            told.rise > LARGEST_RISE,
            told.steps,
            told.acceptance,
            told.energy,
            -here.energy,
        )
        return GuidedState(here.vector, here.predicted, key, adaptation), kept

    def advance(
        state: GuidedState,
        white: Whitening,
        surrogate: Surrogate,
        data: Data,
        step: Array,
        count: Array,
    ) -> tuple[GuidedState, Transition]:
        """`count` iterations, at most CHUNK; what lies behind them in the result is empty.

        `step` is that of the leapfrog; 0 lets the chain adapt its own.
        """
        shapes = jax.eval_shape(iterate, state, white, surrogate, data, step)[1]
        room = jax.tree.map(lambda one: jnp.zeros((CHUNK, *one.shape), one.dtype), shapes)

        def one(index: Array, carry: Any) -> Any:
            state, room = carry
            state, out = iterate(state, white, surrogate, data, step)
            return state, jax.tree.map(lambda rows, row: rows.at[index].set(row), room, out)

        return jax.lax.fori_loop(0, count, one, (state, room))

    return Kernel(start, advance)


def _or_infinite(rise: Array) -> Array:
    return jnp.where(jnp.isnan(rise), jnp.inf, rise)
