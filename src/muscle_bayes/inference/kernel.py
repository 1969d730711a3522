"""One chain's transitions: Hamiltonian trajectories in whitened coordinates within a Gibbs sampler."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from numpyro.infer.hmc_util import dual_averaging

from muscle_bayes.inference.bend_hyst import Unbent
from muscle_bayes.inference.bend_walls import bent_walls
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.density import constrain, potential, potential_given
from muscle_bayes.inference.lane_model import LanePrediction, predictions
from muscle_bayes.inference.noise_moves import disperse, lasting_misfit, move_noise, reading_spacing
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.proposed_move import ProposedMove
from muscle_bayes.inference.walled_moves import WalledState, move_walled
from muscle_bayes.inference.whitening import Whitening, offer, placed, whitened

CHUNK = 50
"""Most iterations of one call; an interruption waits for at most these."""
TARGET_ACCEPTANCE = 0.8
SHORTEST_TRAJECTORY, LONGEST_TRAJECTORY = 0.3 * np.pi, 0.7 * np.pi
"""A quarter of a period forgets the start where whitening is exact. Lengths vary, for the directions in
which it is not exact. Longer ones make means known better but spreads worse, on which chains then agree
late: a fixture's needed half as many draws again with 0.9 pi."""
SHORTEST_STEP = 0.1
"""Least factor by which steps are shortened where misfit is below its typical size."""
MOST_STEPS = 128
"""Leapfrog steps after which a trajectory ends in any case."""
ADAPTED_STEPS = 0.1, 2.0
"""Range of adapted steps. A start on the far side of a jump of the density rejects steps of any length."""
LARGEST_RISE = 1000.0
"""Rise of the energy over a trajectory beyond which it counts as divergent."""
ADAPTATION = dual_averaging(gamma=0.2)
"""Start and update of the adaptation of the leapfrog step: gentle, for a few rejections at the start must
not make steps tiny."""


class Simulated(NamedTuple):
    """The model at one point."""

    predicted: list[LanePrediction]
    slope: list[LanePrediction]
    """Derivatives of these in the whitened smooth entries, along the last axis."""

    def pulled_back(self, through: list[LanePrediction]) -> Float[Array, " smooth"]:
        """Gradient in the whitened entries of what has the gradient `through` in the predictions."""
        parts = zip(jax.tree.leaves(through), jax.tree.leaves(self.slope), strict=True)
        return sum((jnp.tensordot(a, b, a.ndim) for a, b in parts), jnp.zeros(()))


class ChainState(NamedTuple):
    """Where a chain is."""

    z: Float[Array, " smooth"]
    """Whitened smooth entries."""
    rest: Float[Array, " n"]
    """The whole vector at z."""
    simulated: Simulated
    fresh: Bool[Array, ""]
    """Whether `simulated` is of this point."""
    key: Array
    adaptation: Any
    """Of the logarithm of the leapfrog step, by dual averaging."""


class Transition(NamedTuple):
    """What one iteration leaves behind."""

    vector: Float[Array, " n"]
    """Unconstrained."""
    diverging: Bool[Array, ""]
    steps: Int[Array, ""]
    """Leapfrog steps."""
    acceptance: Float[Array, ""]
    energy: Float[Array, ""]
    """Potential and kinetic, at the trajectory's start."""
    log_density: Float[Array, ""]


def adapted_step(adaptation: Any) -> float:
    """The leapfrog step to which adaptation has come."""
    return float(jnp.clip(jnp.exp(adaptation[1]), *ADAPTED_STEPS))


def readapting(adaptation: Any) -> Any:
    """Adaptation begun anew from where it has come."""
    log_step = adaptation[1]
    start, _, slope, count, _ = ADAPTATION[0](log_step)
    return (start + log_step, log_step, slope, count, log_step)


class _Trajectory(NamedTuple):
    """Where a trajectory is."""

    z: Float[Array, " smooth"]
    momentum: Float[Array, " smooth"]
    rest: Float[Array, " n"]
    simulated: Simulated
    fresh: Bool[Array, ""]
    """Whether `simulated` is of z."""
    evaluated: Int[Array, ""]
    """Points so far."""
    steps: Int[Array, ""]
    """To make."""
    begun: Float[Array, ""]
    """Potential at the start; and with kinetic energy:"""
    begun_whole: Float[Array, ""]
    ended: Float[Array, ""]
    """The same at the last point."""
    ended_whole: Float[Array, ""]


class Kernel(NamedTuple):
    """Start and advance of one chain."""

    start: Any
    advance: Any


@lru_cache(maxsize=32)
def kernel_of(layout: Layout) -> Kernel:
    """Kernel of a layout, not compiled."""
    inner, outer, noise = blocks(layout)

    # While the smooth entries move, the walled ones keep their distance from walls: `rest` is bent.
    def point_of(z: Array, white: Whitening, data: Data, rest: Array) -> Unbent:
        return placed(z, rest, white, layout, data).point

    begin_adaptation, adapt = ADAPTATION

    def simulate(z: Array, white: Whitening, data: Data, rest: Array) -> Simulated:
        def predicted(z: Array) -> tuple[list[LanePrediction], list[LanePrediction]]:
            vector, _ = point_of(z, white, data, rest)
            found = predictions(constrain(vector, layout, data), layout, data)
            return found, found

        slope, found = jax.jacfwd(predicted, has_aux=True)(z)
        return Simulated(found, slope)

    def start(key: Array, white: Whitening, data: Data) -> ChainState:
        key_z, key_noise, key_rest = jax.random.split(key, 3)
        z = jax.random.normal(key_z, (inner.size,))
        middle = point_of(z, white, data, white.centre).vector
        rest = disperse(key_noise, middle, white.noise, layout)
        shapes = jax.eval_shape(simulate, z, white, data, rest)
        nothing = jax.tree.map(lambda one: jnp.zeros(one.shape, one.dtype), shapes)
        return ChainState(z, rest, nothing, jnp.asarray(False), key_rest, begin_adaptation())

    def trajectory(
        keys: tuple[Array, Array],
        state: ChainState,
        white: Whitening,
        data: Data,
        step_of: Callable[[Array], tuple[Array, Array]],
    ) -> _Trajectory:
        """Leapfrog steps from the chain's point, the noise drawn anew at its start.

        One simulation with its derivatives serves each point, and the noise's move at the first, for
        which that of the last trajectory's end may be at hand. Written as one loop, for a program
        that simulates in one place compiles in half the time. `step_of(rest)` gives length and number
        of the steps.
        """
        key_noise, key_momentum = keys

        def evaluate(now: _Trajectory) -> _Trajectory:
            simulated = jax.lax.cond(
                now.fresh, lambda: now.simulated, lambda: simulate(now.z, white, data, now.rest)
            )
            predicted, first = simulated.predicted, now.evaluated == 0

            def drawn() -> Array:
                vector, _ = point_of(now.z, white, data, now.rest)
                moved = move_noise(key_noise, predicted, vector, white.noise, layout, data)
                return now.rest.at[noise].set(moved.vector[noise])

            rest = jax.lax.cond(first, drawn, lambda: now.rest)
            step, count = step_of(rest)

            def energy_of(predicted: list[LanePrediction], z: Array) -> Array:
                vector, log_volume = point_of(z, white, data, rest)
                return potential_given(predicted, vector, layout, data) - log_volume

            energy, (through, direct) = jax.value_and_grad(energy_of, (0, 1))(predicted, now.z)
            gradient = direct + simulated.pulled_back(through)
            last = now.evaluated == count
            before = energy + 0.5 * now.momentum @ now.momentum
            share = jnp.where(first | last, 0.5, 1.0)
            momentum = now.momentum - share * step * gradient
            after = energy + 0.5 * momentum @ momentum
            return _Trajectory(
                z=jnp.where(last, now.z, now.z + step * momentum),
                momentum=momentum,
                rest=rest,
                simulated=simulated,
                fresh=last,
                evaluated=now.evaluated + 1,
                steps=count,
                begun=jnp.where(first, energy, now.begun),
                begun_whole=jnp.where(first, before, now.begun_whole),
                ended=energy,
                ended_whole=after,
            )

        none = jnp.zeros(())
        momentum = jax.random.normal(key_momentum, state.z.shape)
        at_hand = state.rest, state.simulated, state.fresh
        counts = jnp.asarray(0), jnp.asarray(1)
        begun = _Trajectory(state.z, momentum, *at_hand, *counts, none, none, none, none)
        return jax.lax.while_loop(lambda now: now.evaluated <= now.steps, evaluate, begun)

    @jax.jit
    def iterate(
        state: ChainState, white: Whitening, data: Data, step: Array
    ) -> tuple[ChainState, Transition]:
        key, key_length, key_accept, key_walled, *keys = jax.random.split(state.key, 6)
        vector = state.rest
        rest = vector.at[outer].set(bent_walls(vector, layout, data)[outer])
        adapting = jnp.clip(jnp.exp(state.adaptation[0]), *ADAPTED_STEPS)
        step = jnp.where(step > 0.0, step, adapting)
        span = LONGEST_TRAJECTORY - SHORTEST_TRAJECTORY
        length = SHORTEST_TRAJECTORY + span * jax.random.uniform(key_length)
        spacing = reading_spacing(layout, data)

        def step_of(rest: Array) -> tuple[Array, Array]:
            # Where misfit is small the others are known well: steps right elsewhere go astray there.
            misfit = jnp.exp(jnp.min(lasting_misfit(rest[noise], spacing) - white.misfit))
            short = step * jnp.clip(misfit, SHORTEST_STEP, 1.0)
            count = jnp.clip(jnp.ceil(length / short), 1, MOST_STEPS)
            return jnp.minimum(length / count, short), count.astype(int)

        moved = trajectory(tuple(keys), state._replace(rest=rest), white, data, step_of)
        rise = moved.ended_whole - moved.begun_whole
        rise = jnp.where(jnp.isnan(rise), jnp.inf, rise)
        acceptance = jnp.exp(jnp.minimum(-rise, 0.0))
        accepted = jax.random.uniform(key_accept) < acceptance
        adaptation = adapt(TARGET_ACCEPTANCE - acceptance, state.adaptation)
        z = jnp.where(accepted, moved.z, state.z)
        energy = jnp.where(accepted, moved.ended, moved.begun)
        vector, log_volume = point_of(z, white, data, moved.rest)
        log_density = -energy - log_volume
        # Whole, for the walled moves look at stiffnesses as they are now.
        rest, fresh = vector, accepted
        if outer.size:

            def energy_at(vector: Array) -> Array:
                return potential(vector, layout, data)

            begun = WalledState(vector, -log_density)

            def offer_at(key: Array, which: Array, vector: Array) -> ProposedMove:
                return offer(key, which, vector, white, layout, data)

            walled = move_walled(key_walled, begun, energy_at, offer_at, layout)
            fresh &= jnp.all(walled.vector == rest)
            rest = walled.vector
            z = whitened(rest, white, layout, data)
            vector, log_density = rest, -walled.energy
        kept = Transition(
            vector,
            rise > LARGEST_RISE,
            moved.steps,
            acceptance,
            moved.begun_whole,
            log_density,
        )
        return ChainState(z, rest, moved.simulated, fresh, key, adaptation), kept

    def advance(
        state: ChainState, white: Whitening, data: Data, step: Array, count: Array
    ) -> tuple[ChainState, Transition]:
        """`count` iterations, at most CHUNK; what lies behind them in the result is empty.

        `step` is that of the leapfrog; 0 lets the chain adapt its own.
        """
        shapes = jax.eval_shape(iterate, state, white, data, step)[1]
        room = jax.tree.map(lambda one: jnp.zeros((CHUNK, *one.shape), one.dtype), shapes)

        def one(index: Array, carry: Any) -> Any:
            state, room = carry
            state, out = iterate(state, white, data, step)
            return state, jax.tree.map(lambda rows, row: rows.at[index].set(row), room, out)

        return jax.lax.fori_loop(0, count, one, (state, room))

    return Kernel(start, advance)
