"""One chain's transitions along a surrogate: a simulation judges where a trajectory ends.

The surrogate's Hamiltonian is followed, which keeps volume and can be run backwards whatever the
surrogate, and the end accepted by the model's own energy (Rasmussen, Bayesian Statistics 7, 2003): draws
are of the model's posterior. No derivative of the simulation is needed.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.inference.bend import unbent, unbent_smooth
from muscle_bayes.inference.bend_hyst import Unbent
from muscle_bayes.inference.bend_walls import bent_walls
from muscle_bayes.inference.blocks import blocks
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
    ChainState,
    Kernel,
    Transition,
)
from muscle_bayes.inference.lane_model import LanePrediction, predictions
from muscle_bayes.inference.noise_moves import disperse, lasting_misfit, move_noise, reading_spacing
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.surrogate import Surrogate
from muscle_bayes.inference.walled_moves import WalledState, move_walled
from muscle_bayes.inference.whitening import Whitening, whitened

TARGET_ACCEPTANCE = 0.9
"""Of trajectories by the surrogate's own energy: steps cost little."""


class _Moving(NamedTuple):
    z: Float[Array, " smooth"]
    momentum: Float[Array, " smooth"]
    gradient: Float[Array, " smooth"]
    begun: Float[Array, ""]
    """Energy by the surrogate at the start, and at the last point:"""
    ended: Float[Array, ""]


@lru_cache(maxsize=32)
def guided_kernel_of(layout: Layout) -> Kernel:
    """Kernel of a layout, not compiled."""
    inner, outer, noise = blocks(layout)

    def placed(z: Array, white: Whitening, rest: Array) -> Array:
        return rest.at[inner].set(white.centre[inner] + white.factor @ z)

    # While the smooth entries move, the walled ones keep their distance from walls: `rest` is bent.
    def point_of(z: Array, white: Whitening, data: Data, rest: Array) -> Unbent:
        return unbent(placed(z, white, rest), white.bend, layout, data)

    # While the walled entries move, the smooth ones stay: `rest` is not bent.
    def point_with(z: Array, white: Whitening, data: Data, rest: Array) -> Unbent:
        return unbent_smooth(placed(z, white, rest), white.bend, layout, data)

    @jax.jit
    def simulate(vector: Array, data: Data) -> list[LanePrediction]:
        return predictions(constrain(vector, layout, data), layout, data)

    def start(key: Array, white: Whitening, data: Data) -> ChainState:
        key_z, key_noise, key_rest = jax.random.split(key, 3)
        middle = unbent(white.centre, white.bend, layout, data).vector
        rest = disperse(key_noise, middle, white.noise, layout)
        z = jax.random.normal(key_z, (inner.size,))
        shapes = jax.eval_shape(simulate, rest, data)
        nothing = jax.tree.map(lambda one: jnp.zeros(one.shape, one.dtype), shapes)
        return ChainState(z, rest, nothing, jnp.asarray(False), key_rest, ADAPTATION[0]())

    def iterate(
        state: ChainState, white: Whitening, surrogate: Surrogate, data: Data, step: Array
    ) -> tuple[ChainState, Transition]:
        key, key_length, key_accept, key_walled, key_noise, key_momentum = jax.random.split(
            state.key, 6
        )
        z, predicted = state.z, state.simulated
        vector, _ = point_with(z, white, data, state.rest)
        rest = state.rest.at[outer].set(bent_walls(vector, layout, data)[outer])

        # The noise given the predictions.
        moved = move_noise(key_noise, predicted, vector, white.noise, layout, data)
        rest = rest.at[noise].set(moved[noise])
        walled_away = rest[outer] - white.centre[outer]

        def energy_of(predicted: list[LanePrediction], z: Array) -> Array:
            vector, log_volume = point_of(z, white, data, rest)
            return potential_given(predicted, vector, layout, data) - log_volume

        # A trajectory along the surrogate.
        def along(z: Array) -> Array:
            return energy_of(surrogate.at(jnp.concatenate([z, walled_away])), z)

        adapting = jnp.clip(jnp.exp(state.adaptation[0]), *ADAPTED_STEPS)
        step = jnp.where(step > 0.0, step, adapting)
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
            energy, gradient = jax.value_and_grad(along)(z)
            momentum = jnp.where(first, now.momentum, half - 0.5 * stride * gradient)
            return _Moving(z, momentum, gradient, jnp.where(first, energy, now.begun), energy)

        momentum = jax.random.normal(key_momentum, z.shape)
        nothing = jnp.zeros(())
        begin = _Moving(z, momentum, jnp.zeros_like(z), nothing, nothing)
        ended = jax.lax.fori_loop(0, count + 1, leap, begin)
        kinetic = 0.5 * momentum @ momentum
        kinetic_ended = 0.5 * ended.momentum @ ended.momentum
        rise_along = _or_infinite(ended.ended + kinetic_ended - ended.begun - kinetic)
        adaptation = ADAPTATION[1](
            TARGET_ACCEPTANCE - jnp.exp(jnp.minimum(-rise_along, 0.0)), state.adaptation
        )

        # The model says whether it ended well.
        found = simulate(point_of(ended.z, white, data, rest).vector, data)
        begun_energy, ended_energy = energy_of(predicted, z), energy_of(found, ended.z)
        rise = _or_infinite(ended_energy + kinetic_ended - begun_energy - kinetic)
        acceptance = jnp.exp(jnp.minimum(-rise, 0.0))
        accepted = jax.random.uniform(key_accept) < acceptance
        z = jnp.where(accepted, ended.z, z)
        predicted = jax.tree.map(lambda a, b: jnp.where(accepted, a, b), found, predicted)
        energy = jnp.where(accepted, ended_energy, begun_energy)
        vector, log_volume = point_of(z, white, data, rest)
        log_density = -energy - log_volume
        # Whole, for the walled moves look at stiffnesses as they are now.
        rest = vector
        if outer.size:

            def energy_at(vector: Array) -> tuple[Array, list[LanePrediction]]:
                found = simulate(vector, data)
                return potential_given(found, vector, layout, data), found

            walled = move_walled(
                key_walled,
                WalledState(vector, -log_density, predicted),
                energy_at,
                white.walled,
                data.tension,
                layout,
            )
            rest, predicted = walled.vector, walled.simulated
            z = whitened(rest, white, layout, data)
            vector, log_density = rest, -walled.energy
        kept = Transition(
            vector,
            rise_along > LARGEST_RISE,
            count,
            acceptance,
            begun_energy + kinetic,
            log_density,
        )
        return ChainState(z, rest, predicted, state.fresh, key, adaptation), kept

    def advance(
        state: ChainState,
        white: Whitening,
        surrogate: Surrogate,
        data: Data,
        step: Array,
        count: Array,
    ) -> tuple[ChainState, Transition]:
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
