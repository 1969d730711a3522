"""Draws from a posterior: NumPyro's NUTS on whitened coordinates, chains side by side."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.infer.hmc import hmc

from muscle_bayes.inference.density import potential
from muscle_bayes.inference.optimise import Mode
from muscle_bayes.inference.problem import Data, Layout

CHUNK = 50
"""Iterations between two reports of progress; an interruption waits for at most these."""
TARGET_ACCEPTANCE = 0.85
MAX_TREE_DEPTH = 8
SWEEPS = 6
WALLED = ("F_modulus_min", "F_hyst_min")


class Whitening(NamedTuple):
    """vector[smooth] = centre + factor @ z: given the rest, nearly a standard normal in z."""

    centre: Float[Array, " n"]
    factor: Float[Array, "smooth smooth"]
    stride: Float[Array, " walled"]
    """Standard deviation of Metropolis proposals for the walled entries."""


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


def walled(layout: Layout) -> np.ndarray:
    """Entries of the vector whose posterior ends in a wall: the springs' minimum forces.

    Below the least force in the record they change nothing, above it nearly everything. Such a wall
    throws NUTS off, so these entries are moved by Metropolis steps between NUTS steps.
    """
    flags = [np.full(int(np.prod(shape)), name in WALLED) for name, shape in layout.shapes]
    return np.flatnonzero(np.concatenate(flags))


def smooth(layout: Layout) -> np.ndarray:
    """Entries of the vector that NUTS moves."""
    size = sum(int(np.prod(shape)) for _, shape in layout.shapes)
    return np.setdiff1d(np.arange(size), walled(layout))


def whitening(mode: Mode, layout: Layout) -> Whitening:
    """Whitening by the Fisher information at the mode, walled entries held fixed."""
    inner, outer = smooth(layout), walled(layout)
    covariance = np.linalg.inv(np.asarray(mode.information)[np.ix_(inner, inner)])
    factor = np.linalg.cholesky(0.5 * (covariance + covariance.T))
    stride = 2.4 / np.sqrt(np.diag(np.asarray(mode.information))[outer])
    return Whitening(mode.vector, jnp.asarray(factor), jnp.asarray(stride))


class _ChainState(NamedTuple):
    nuts: Any
    edge: Float[Array, " walled"]
    key: Array


@lru_cache(maxsize=32)
def _kernel(layout: Layout, warmup: int) -> tuple[Callable, Callable]:
    """Compiled start and advance of one chain; they serve every data set of the layout."""
    inner, outer = smooth(layout), walled(layout)

    def vector_of(z: Array, white: Whitening, edge: Array) -> Array:
        whole = white.centre.at[inner].add(white.factor @ z)
        return whole.at[outer].set(edge)

    def density_of(white: Whitening, data: Data, edge: Array) -> Callable:
        return lambda z: potential(vector_of(z, white, edge), layout, data)

    begin, sample = hmc(potential_fn_gen=density_of, algo="NUTS")

    @jax.jit
    def start(key: Array, white: Whitening, data: Data) -> _ChainState:
        key_z, key_nuts, key_edge = jax.random.split(key, 3)
        z = jax.random.normal(key_z, (inner.size,))
        edge = white.centre[outer]
        nuts = begin(
            z,
            num_warmup=warmup,
            dense_mass=True,
            target_accept_prob=TARGET_ACCEPTANCE,
            max_tree_depth=MAX_TREE_DEPTH,
            model_args=(white, data, edge),
            rng_key=key_nuts,
        )
        return _ChainState(nuts, edge, key_edge)

    def move_edges(state: _ChainState, white: Whitening, data: Data) -> _ChainState:
        """SWEEPS Metropolis proposals for each walled entry; their density needs no gradient."""
        key, key_step, key_accept, key_reach = jax.random.split(state.key, 4)
        count = SWEEPS * outer.size
        steps = jax.random.normal(key_step, (count,))
        # Long and short proposals: a wall near or far from here is reached by either.
        steps = steps * 10.0 ** -jax.random.uniform(key_reach, (count,))
        chances = jnp.log(jax.random.uniform(key_accept, (count,)))
        entries = jnp.arange(count) % outer.size

        def propose(carry: tuple[Array, Array], now: Any) -> Any:
            edge, energy = carry
            entry, step, chance = now
            trial = edge.at[entry].add(white.stride[entry] * step)
            trial_energy = density_of(white, data, trial)(state.nuts.z)
            accept = chance < energy - trial_energy
            moved = jnp.where(accept, trial, edge), jnp.where(accept, trial_energy, energy)
            return moved, None

        start = state.edge, state.nuts.potential_energy
        (edge, _), _ = jax.lax.scan(propose, start, (entries, steps, chances))
        energy, gradient = jax.value_and_grad(density_of(white, data, edge))(state.nuts.z)
        nuts = state.nuts._replace(potential_energy=energy, z_grad=gradient)
        return _ChainState(nuts, edge, key)

    @partial(jax.jit, static_argnames="count")
    def advance(state: _ChainState, white: Whitening, data: Data, count: int) -> Any:
        def one(state: _ChainState, _: None) -> Any:
            nuts = sample(state.nuts, model_args=(white, data, state.edge))
            kept = (nuts.diverging, nuts.num_steps, nuts.accept_prob, nuts.energy)
            state = state._replace(nuts=nuts)
            if outer.size:
                state = move_edges(state, white, data)
            vector = vector_of(state.nuts.z, white, state.edge)
            return state, (vector, *kept, -state.nuts.potential_energy)

        return jax.lax.scan(one, state, None, length=count)

    return start, advance


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
    white = whitening(mode, layout)
    start, advance = _kernel(layout, warmup)

    def chain(index: int) -> list[np.ndarray]:
        # Worker threads do not inherit the caller's precision.
        with jax.enable_x64(True):
            state, kept, done = start(jax.random.fold_in(key, index), white, data), [], 0
            while done < warmup + draws:
                count = min(CHUNK, warmup + draws - done)
                state, out = advance(state, white, data, count)
                out = jax.device_get(out)
                done += count
                if done > warmup:
                    kept.append([part[-min(count, done - warmup) :] for part in out])
                report(count)
            return [np.concatenate(parts) for parts in zip(*kept, strict=True)]

    with ThreadPoolExecutor(workers) as pool:
        results = list(pool.map(chain, range(chains)))
    return Draws(*(np.stack(parts) for parts in zip(*results, strict=True)))
