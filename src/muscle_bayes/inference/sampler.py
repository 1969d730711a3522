"""Draws from a posterior: NumPyro's NUTS on whitened coordinates within a Gibbs sampler."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.infer.hmc import hmc

from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.density import constrain, potential, potential_given
from muscle_bayes.inference.lane_model import LanePrediction, predictions
from muscle_bayes.inference.noise_moves import Proposal, adapt, disperse, move_noise
from muscle_bayes.inference.optimise import Mode
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.walled_moves import WalledState, move_walled

CHUNK = 50
"""Iterations between two reports of progress; an interruption waits for at most these."""
TARGET_ACCEPTANCE = 0.8
MAX_TREE_DEPTH = 8
NOISE_SPREAD = 0.7
"""Standard deviation of the unconstrained noise parameters from which their proposal is adapted."""


class Whitening(NamedTuple):
    """vector[smooth] = centre[smooth] + factor @ z: given the rest, nearly a standard normal in z."""

    centre: Float[Array, " n"]
    factor: Float[Array, "smooth smooth"]
    stride: Float[Array, " walled"]
    """Standard deviation of Metropolis proposals for the walled entries."""
    noise: Proposal
    """For the noise entries."""


class Draws(NamedTuple):
    """What the chains did after warm-up."""

    vector: Float[np.ndarray, "chain draw n"]
    """Unconstrained."""
    diverging: np.ndarray
    steps: np.ndarray
    """Leapfrog steps of each draw."""
    acceptance: np.ndarray
    energy: np.ndarray
    log_density: np.ndarray


def whitening(key: Array, mode: Mode, layout: Layout, data: Data) -> Whitening:
    """Whitening by the Fisher information at the mode, given the walled and the noise entries."""
    inner, outer, noise = blocks(layout)
    information = np.asarray(mode.information)
    covariance = np.linalg.inv(information[np.ix_(inner, inner)])
    factor = np.linalg.cholesky(0.5 * (covariance + covariance.T))
    stride = 2.4 / np.sqrt(np.diag(information)[outer])
    spread = NOISE_SPREAD * np.ones(noise.size)
    proposal = adapt(key, mode.vector, jnp.asarray(spread), layout, data)
    return Whitening(mode.vector, jnp.asarray(factor), jnp.asarray(stride), proposal)


class _ChainState(NamedTuple):
    nuts: Any
    rest: Float[Array, " n"]
    """Whole vector; only its walled and noise entries count."""
    key: Array


@lru_cache(maxsize=32)
def _kernel(layout: Layout, warmup: int) -> tuple[Callable, Callable]:
    """Compiled start and advance of one chain; they serve every data set of the layout."""
    inner, outer, _ = blocks(layout)

    def vector_of(z: Array, white: Whitening, rest: Array) -> Array:
        return rest.at[inner].set(white.centre[inner] + white.factor @ z)

    def density_of(white: Whitening, data: Data, rest: Array) -> Callable:
        return lambda z: potential(vector_of(z, white, rest), layout, data)

    begin, sample = hmc(potential_fn_gen=density_of, algo="NUTS")

    @jax.jit
    def start(key: Array, white: Whitening, data: Data) -> _ChainState:
        key_z, key_nuts, key_noise, key_rest = jax.random.split(key, 4)
        rest = disperse(key_noise, white.centre, white.noise, layout)
        nuts = begin(
            jax.random.normal(key_z, (inner.size,)),
            num_warmup=warmup,
            target_accept_prob=TARGET_ACCEPTANCE,
            max_tree_depth=MAX_TREE_DEPTH,
            model_args=(white, data, rest),
            rng_key=key_nuts,
        )
        return _ChainState(nuts, rest, key_rest)

    def iterate(state: _ChainState, white: Whitening, data: Data) -> tuple[_ChainState, tuple]:
        key, key_walled, key_noise = jax.random.split(state.key, 3)
        nuts, rest = sample(state.nuts, model_args=(white, data, state.rest)), state.rest
        kept = (nuts.diverging, nuts.num_steps, nuts.accept_prob, nuts.energy)
        if outer.size:

            def energy_at(z: Array, rest: Array) -> Array:
                return density_of(white, data, rest)(z)

            start = WalledState(nuts.z, vector_of(nuts.z, white, rest), nuts.potential_energy)
            moved = move_walled(key_walled, start, energy_at, white.factor, white.stride, layout)
            nuts, rest = nuts._replace(z=moved.z), moved.vector

        # One simulation with its derivatives serves the noise's move and the next start of NUTS.
        def simulate(z: Array) -> list[LanePrediction]:
            return predictions(constrain(vector_of(z, white, rest), layout, data), layout, data)

        predicted, pull_back = jax.vjp(simulate, nuts.z)
        vector = vector_of(nuts.z, white, rest)
        rest = move_noise(key_noise, predicted, vector, white.noise, layout, data)

        def energy_of(predicted: list[LanePrediction], z: Array) -> Array:
            return potential_given(predicted, vector_of(z, white, rest), layout, data)

        energy, (through, direct) = jax.value_and_grad(energy_of, (0, 1))(predicted, nuts.z)
        gradient = direct + pull_back(through)[0]
        nuts = nuts._replace(potential_energy=energy, z_grad=gradient)
        return _ChainState(nuts, rest, key), (vector_of(nuts.z, white, rest), *kept, -energy)

    @jax.jit
    def advance(state: _ChainState, white: Whitening, data: Data, count: Array) -> Any:
        """`count` iterations, at most CHUNK; what lies behind them in the result is empty."""
        shapes = jax.eval_shape(iterate, state, white, data)[1]
        room = jax.tree.map(lambda one: jnp.zeros((CHUNK, *one.shape), one.dtype), shapes)

        def one(index: Array, carry: Any) -> Any:
            state, room = carry
            state, out = iterate(state, white, data)
            return state, jax.tree.map(lambda rows, row: rows.at[index].set(row), room, out)

        return jax.lax.fori_loop(0, count, one, (state, room))

    return start, advance


def compile_for(layout: Layout, data: Data, warmup: int) -> None:
    """Compile what `draw` needs, so that it can be done while the mode is searched."""
    size = sum(int(np.prod(shape)) for _, shape in layout.shapes)
    with jax.enable_x64(True):
        anywhere = Mode(jnp.zeros(size), 0.0, jnp.eye(size), 0)
        white = whitening(jax.random.key(0), anywhere, layout, data)
        start, advance = _kernel(layout, warmup)
        advance(start(jax.random.key(0), white, data), white, data, 0)


def draw(
    key: Array,
    mode: Mode,
    layout: Layout,
    data: Data,
    *,
    chains: int,
    warmup: int,
    draws: int,
    workers: int = 2,
    report: Callable[[int], None] = lambda done: None,
) -> Draws:
    """`draws` per chain after `warmup`, each chain from its own dispersed start.

    `report` is told of every CHUNK of iterations that a chain has done.
    """
    white = whitening(jax.random.fold_in(key, chains), mode, layout, data)
    start, advance = _kernel(layout, warmup)

    def chain(index: int) -> list[np.ndarray]:
        # Worker threads do not inherit the caller's precision.
        with jax.enable_x64(True):
            state, kept, done = start(jax.random.fold_in(key, index), white, data), [], 0
            while done < warmup + draws:
                count = min(CHUNK, warmup + draws - done)
                state, out = advance(state, white, data, count)
                fresh = min(count, max(0, done + count - warmup))
                kept.append([part[count - fresh : count] for part in jax.device_get(out)])
                done += count
                report(count)
            return [np.concatenate(parts) for parts in zip(*kept, strict=True)]

    with ThreadPoolExecutor(workers) as pool:
        results = list(pool.map(chain, range(chains)))
    return Draws(*(np.stack(parts) for parts in zip(*results, strict=True)))
