"""One chain's transitions: NumPyro's HMC on whitened coordinates within a Gibbs sampler, compiled."""

from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from numpyro.infer.hmc import hmc
from numpyro.infer.hmc_util import dual_averaging

from muscle_bayes.inference.bend import unbent, unbent_smooth
from muscle_bayes.inference.bend_hyst import Unbent
from muscle_bayes.inference.bend_walls import bent_walls
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.density import constrain, potential, potential_given
from muscle_bayes.inference.lane_model import LanePrediction, predictions
from muscle_bayes.inference.noise_moves import disperse, lasting_misfit, move_noise, reading_spacing
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.walled_moves import WalledState, move_walled
from muscle_bayes.inference.whitening import Whitening, blank

CHUNK = 50
"""Most iterations of one call; an interruption waits for at most these."""
TARGET_ACCEPTANCE = 0.8
SHORTEST_TRAJECTORY, LONGEST_TRAJECTORY = 0.25 * np.pi, 0.75 * np.pi
"""A quarter of a period forgets the start where whitening is exact; lengths vary around it, for the
directions in which it is not and lest trajectories return."""
SHORTEST_STEP = 0.1
"""Least factor by which steps are shortened where misfit is below its typical size."""
MOST_STEPS = 128
"""Leapfrog steps after which a trajectory ends in any case."""
ADAPTED_STEPS = 0.1, 2.0
"""Range of adapted steps. A start on the far side of a jump of the density rejects steps of any length."""
ADAPTATION = dual_averaging(gamma=0.2)
"""Start and update of the adaptation of the leapfrog step: gentle, for a few rejections at the start must
not make steps tiny."""


class ChainState(NamedTuple):
    """Where a chain is."""

    hmc: Any
    rest: Float[Array, " n"]
    """Whole vector; only its walled and noise entries count."""
    key: Array
    adaptation: Any
    """Of the logarithm of the leapfrog step, by dual averaging."""

    @property
    def adapted_step(self) -> float:
        """The step to which adaptation has come."""
        return float(jnp.clip(jnp.exp(self.adaptation[1]), *ADAPTED_STEPS))


class Transition(NamedTuple):
    """What one iteration leaves behind."""

    vector: Float[Array, " n"]
    """Unconstrained."""
    diverging: Bool[Array, ""]
    steps: Int[Array, ""]
    """Leapfrog steps."""
    acceptance: Float[Array, ""]
    energy: Float[Array, ""]
    log_density: Float[Array, ""]


def restart(state: ChainState, z: Float[np.ndarray, " smooth"]) -> ChainState:
    """The chain at whitened coordinates `z`, to adapt its step anew from where adaptation has come."""
    log_step = state.adaptation[1]
    start, _, slope, count, _ = ADAPTATION[0](log_step)
    adaptation = (start + log_step, log_step, slope, count, log_step)
    return state._replace(hmc=state.hmc._replace(z=jnp.asarray(z)), adaptation=adaptation)


class Kernel(NamedTuple):
    """Start and advance of one chain."""

    start: Any
    advance: Any


@lru_cache(maxsize=32)
def _kernel(layout: Layout) -> Kernel:
    """Kernel of a layout, not compiled; it serves every data set of the layout."""
    inner, outer, noise = blocks(layout)

    # While the smooth entries move, the walled ones keep their distance from walls: `rest` is bent.
    def point_of(z: Array, white: Whitening, data: Data, rest: Array) -> Unbent:
        bent = rest.at[inner].set(white.centre[inner] + white.factor @ z)
        return unbent(bent, white.bend, layout, data)

    # While the walled entries move, the smooth ones stay: `rest` is not bent.
    def point_with(z: Array, white: Whitening, data: Data, rest: Array) -> Unbent:
        bent = rest.at[inner].set(white.centre[inner] + white.factor @ z)
        return unbent_smooth(bent, white.bend, layout, data)

    def density_of(white: Whitening, data: Data, rest: Array) -> Callable:
        def energy(z: Array) -> Array:
            vector, log_volume = point_of(z, white, data, rest)
            return potential(vector, layout, data) - log_volume

        return energy

    begin, sample = hmc(potential_fn_gen=density_of, algo="HMC")
    begin_adaptation, adapt = ADAPTATION

    @jax.jit
    def start(key: Array, white: Whitening, data: Data) -> ChainState:
        key_z, key_hmc, key_noise, key_rest = jax.random.split(key, 4)
        middle = unbent(white.centre, white.bend, layout, data).vector
        rest = disperse(key_noise, middle, white.noise, layout)
        hmc_state = begin(
            jax.random.normal(key_z, (inner.size,)),
            num_warmup=0,
            adapt_step_size=False,
            adapt_mass_matrix=False,
            trajectory_length=LONGEST_TRAJECTORY,
            model_args=(white, data, rest),
            rng_key=key_hmc,
        )
        # `iterate` computes energy and gradient itself: so dropped, they are not even compiled here.
        none = jnp.zeros(())
        hmc_state = hmc_state._replace(
            potential_energy=none, energy=none, z_grad=jnp.zeros(inner.size)
        )
        return ChainState(hmc_state, rest, key_rest, begin_adaptation())

    def iterate(
        state: ChainState, white: Whitening, data: Data, step: Array
    ) -> tuple[ChainState, Transition]:
        key, key_noise, key_length, key_walled = jax.random.split(state.key, 4)
        hmc_state = state.hmc
        vector, _ = point_with(hmc_state.z, white, data, state.rest)
        rest = state.rest.at[outer].set(bent_walls(vector, layout, data)[outer])

        # One simulation with its derivatives serves the noise's move and the start of a trajectory.
        def simulate(z: Array) -> list[LanePrediction]:
            vector, _ = point_of(z, white, data, rest)
            return predictions(constrain(vector, layout, data), layout, data)

        predicted, pull_back = jax.vjp(simulate, hmc_state.z)
        drawn = move_noise(key_noise, predicted, vector, white.noise, layout, data)
        rest = rest.at[noise].set(drawn[noise])

        def energy_of(predicted: list[LanePrediction], z: Array) -> Array:
            vector, log_volume = point_of(z, white, data, rest)
            return potential_given(predicted, vector, layout, data) - log_volume

        energy, (through, direct) = jax.value_and_grad(energy_of, (0, 1))(predicted, hmc_state.z)
        gradient = direct + pull_back(through)[0]
        # Where misfit is small the others are known well: steps that are right elsewhere go astray there.
        lasting = lasting_misfit(rest[noise], reading_spacing(layout, data))
        misfit = jnp.exp(jnp.min(lasting - white.misfit))
        scale = jnp.clip(misfit, SHORTEST_STEP, 1.0)
        adapting = jnp.clip(jnp.exp(state.adaptation[0]), *ADAPTED_STEPS)
        step = jnp.where(step > 0.0, step, adapting)
        span = LONGEST_TRAJECTORY - SHORTEST_TRAJECTORY
        length = SHORTEST_TRAJECTORY + span * jax.random.uniform(key_length)
        most = MOST_STEPS * scale * step
        hmc_state = hmc_state._replace(
            potential_energy=energy,
            z_grad=gradient,
            trajectory_length=jnp.minimum(length, most),
            adapt_state=hmc_state.adapt_state._replace(step_size=scale * step),
        )
        hmc_state = sample(hmc_state, model_args=(white, data, rest))
        adaptation = adapt(TARGET_ACCEPTANCE - hmc_state.accept_prob, state.adaptation)
        vector, log_volume = point_of(hmc_state.z, white, data, rest)
        log_density = -hmc_state.potential_energy - log_volume
        # Whole, for the walled moves look at stiffnesses as they are now.
        rest = vector
        if outer.size:

            def energy_at(z: Array, rest: Array) -> Array:
                vector, log_volume = point_with(z, white, data, rest)
                return potential(vector, layout, data) - log_volume

            energy = -log_density - point_with(hmc_state.z, white, data, rest).log_volume
            begun = WalledState(hmc_state.z, rest, energy)
            moved = move_walled(
                key_walled, begun, energy_at, white.factor, white.walled, data.tension, layout
            )
            hmc_state, rest = hmc_state._replace(z=moved.z), moved.vector
            vector, log_volume = point_with(hmc_state.z, white, data, rest)
            log_density = -moved.energy - log_volume
        kept = Transition(
            vector,
            hmc_state.diverging,
            hmc_state.num_steps,
            hmc_state.accept_prob,
            hmc_state.energy,
            log_density,
        )
        return ChainState(hmc_state, rest, key, adaptation), kept

    @jax.jit
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


class Preparation:
    """A kernel that is traced; compiling it can be left to another thread, tracing cannot.

    JAX traces the same function in two threads at once at its peril, and tracing holds Python's lock.
    """

    def __init__(self, layout: Layout, data: Data) -> None:
        kernel, key, white = _kernel(layout), jax.random.key(0), blank(layout)
        start = kernel.start.trace(key, white, data)
        state = start.out_info
        advance = kernel.advance.trace(state, white, data, jnp.asarray(0.0), jnp.asarray(0))
        self._lowered = Kernel(start.lower(), advance.lower())

    @cached_property
    def kernel(self) -> Kernel:
        """The kernel, compiled."""
        with jax.enable_x64(True):
            return Kernel(*(one.compile() for one in self._lowered))


_PREPARED: dict[Any, Preparation] = {}


def prepare(layout: Layout, data: Data) -> Preparation:
    """The preparation for data of this layout and these shapes, made once in a session."""
    leaves, structure = jax.tree.flatten(data)
    shapes = tuple((leaf.shape, leaf.dtype) for leaf in leaves)
    known = (layout, structure, shapes)
    if known not in _PREPARED:
        _PREPARED[known] = Preparation(layout, data)
    return _PREPARED[known]
