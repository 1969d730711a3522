"""Draws from a posterior: chains that share what warm-up taught, sampled until they agree."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, NamedTuple

import arviz as az
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.kernel import CHUNK, ChainState, Preparation, restart
from muscle_bayes.inference.optimise import Mode
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.whitening import rewhiten, whitening

MAX_RHAT = 1.01
STAGES = 3
"""Of the warm-up."""


@dataclass(frozen=True)
class Effort:
    """How long to sample."""

    chains: int = 4
    warmup: int = 200
    """Iterations of each chain that are not kept."""
    draws: int = 1000
    """Of each chain, before convergence is judged."""
    rounds: int = 3
    """Most times that so many draws are made."""
    min_ess: int = 400
    """Bulk effective sample size that is wanted of every sampled quantity."""


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


def agree(draws: Draws, min_ess: int) -> bool:
    """Whether rank-normalised R-hat and bulk ESS of every entry of the vector are good enough.

    Both are the same for an entry and for the sampled quantity that it stands for.
    """
    values = az.convert_to_datatree({"v": draws.vector}).posterior
    rhat, ess = az.rhat(values)["v"], az.ess(values)["v"]
    return bool(rhat.max() <= MAX_RHAT and ess.min() >= min_ess)


def draw(
    key: Array,
    mode: Mode,
    preparation: Preparation,
    layout: Layout,
    data: Data,
    effort: Effort,
    *,
    workers: int = 2,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Draws:
    """Draws of several chains, each from its own dispersed start.

    Between the stages of the warm-up the whitening is rescaled by what all chains have seen. Each
    adapts its leapfrog step; after warm-up all take the geometric mean of these. Draws are made in rounds until
    the chains agree. `preparation` is that of the layout and the data.
    `report(done, total)` is told of every CHUNK of iterations that a chain has done.
    """
    white = whitening(jax.random.fold_in(key, effort.chains), mode, layout, data)
    kernel = preparation.kernel
    done, total = 0, effort.chains * (effort.warmup + effort.draws)

    def advance(state: ChainState, step: float, count: int) -> tuple[ChainState, Draws]:
        nonlocal done
        kept = []
        # Worker threads do not inherit the caller's precision.
        with jax.enable_x64(True):
            while count:
                size = min(CHUNK, count)
                state, rows = kernel.advance(
                    state, white, data, jnp.asarray(step), jnp.asarray(size)
                )
                kept.append(tuple(part[:size] for part in jax.device_get(rows)))
                count, done = count - size, done + size
                report(done, total)
        return state, Draws(*(np.concatenate(parts) for parts in zip(*kept, strict=True)))

    def begin(index: int) -> ChainState:
        with jax.enable_x64(True):
            return kernel.start(jax.random.fold_in(key, index), white, data)

    def everywhere(states: Iterable[ChainState], step: float, count: int) -> Any:
        """All chains' states after `count` iterations, and what they drew."""
        results = pool.map(lambda state: advance(state, step, count), states)
        after, drawn = zip(*results, strict=True)
        return after, Draws(*(np.stack(parts) for parts in zip(*drawn, strict=True)))

    rounds: list[Draws] = []
    with ThreadPoolExecutor(workers) as pool:
        states: Iterable[ChainState] = pool.map(begin, range(effort.chains))
        for stage in range(STAGES):
            count = effort.warmup * (stage + 1) // STAGES - effort.warmup * stage // STAGES
            states, early = everywhere(states, 0.0, count)
            if stage < STAGES - 1:
                white, last = rewhiten(white, early.vector[:, count // 2 :], layout, data)
                states = [restart(state, z) for state, z in zip(states, last, strict=True)]
        step = float(np.exp(np.mean([np.log(state.adapted_step) for state in states])))
        while True:
            states, drawn = everywhere(states, step, effort.draws)
            rounds.append(drawn)
            draws = Draws(*(np.concatenate(parts, axis=1) for parts in zip(*rounds, strict=True)))
            if len(rounds) == effort.rounds or agree(draws, effort.min_ess):
                return draws
            total += effort.chains * effort.draws
