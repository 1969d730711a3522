"""Draws from a posterior: chains that share what warm-up taught, sampled until they agree."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Lock
from typing import Any, NamedTuple

import arviz as az
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.guided_kernel import GuidedState
from muscle_bayes.inference.kernel import (
    CHUNK,
    Kernel,
    Transition,
    adapted_step,
    readapting,
)
from muscle_bayes.inference.mode import Mode
from muscle_bayes.inference.preparation import Preparation
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.programs import predictions_at
from muscle_bayes.inference.surrogate import first_surrogate, learned_surrogate
from muscle_bayes.inference.whitening import Whitening
from muscle_bayes.inference.whitening_at_mode import whitening
from muscle_bayes.inference.whitening_of_draws import rewhiten

MAX_RHAT = 1.01
RHAT_MARGIN = 5e-4
"""What R-hat of the sampled quantities may exceed that of the unconstrained vector by: its folded part
is not the same after a transform."""
STAGES = 3
"""Of the warm-up."""
ADAPTING = 0.0
"""Stands for the leapfrog step that every chain adapts for itself."""
SHORTER = 1.0, 0.5, 0.25, 0.125
"""Shares of the adapted leapfrog step that are tried in turn while transitions diverge."""
FAITHFUL = 0.1
"""Mean acceptance of a warm-up's first stage below which the surrogate is given up. That of a muscle's
is 0.5 to 0.75 there, also where dead bands have edges within the posterior. The model's own trajectories
simulate twenty times as often, with derivatives."""


@dataclass(frozen=True)
class Effort:
    """How long to sample."""

    chains: int = 4
    warmup: int = 120
    """Iterations of each chain that are not kept."""
    draws: int = 200
    """Of each chain, before convergence is judged."""
    rounds: int = 60
    """Most rounds of draws; every one after the first makes a third as many."""
    min_ess: int = 400
    """Bulk effective sample size that is wanted of every sampled quantity."""
    max_rhat: float = MAX_RHAT
    """Largest R-hat with which chains count as agreeing. Its own scatter grows as draws get fewer."""


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


def agree(draws: Draws, effort: Effort) -> bool:
    """Whether rank-normalised R-hat and bulk ESS of every entry of the vector are good enough.

    Bulk ESS is the same for an entry and for the sampled quantity that it stands for, R-hat nearly.
    """
    values = az.convert_to_datatree({"v": draws.vector}).posterior
    rhat, ess = az.rhat(values)["v"], az.ess(values)["v"]
    agreed = rhat.max() <= effort.max_rhat - RHAT_MARGIN
    return bool(agreed and ess.min() >= effort.min_ess)


class _Chains:
    """Chains that advance side by side."""

    def __init__(
        self,
        keys: Sequence[Array],
        white: Whitening,
        kernel: Kernel,
        data: Data,
        pool: ThreadPoolExecutor,
        report: Callable[[int], None],
    ) -> None:
        self._white, self._kernel, self._data = white, kernel, data
        self._pool, self._report = pool, report
        self._states = list(pool.map(self._begin, keys))

    def _begin(self, key: Array) -> Any:
        # Worker threads do not inherit the caller's precision.
        with jax.enable_x64(True):
            return self._kernel.start(key, self._white, self._data)

    def _advance(self, state: Any, step: float, count: int) -> tuple[Any, Draws]:
        kept = []
        with jax.enable_x64(True):
            while count:
                size = min(CHUNK, count)
                state, rows = self._advanced(state, jnp.asarray(step), jnp.asarray(size))
                kept.append(tuple(part[:size] for part in jax.device_get(rows)))
                count -= size
                self._report(size)
        return state, Draws(*(np.concatenate(parts) for parts in zip(*kept, strict=True)))

    def _advanced(self, state: Any, step: Array, count: Array) -> tuple[Any, Transition]:
        return self._kernel.advance(state, self._white, self._data, step, count)

    def advance(self, step: float, count: int) -> Draws:
        """What every chain draws in `count` iterations."""
        results = self._pool.map(lambda state: self._advance(state, step, count), self._states)
        states, drawn = zip(*results, strict=True)
        self._states = list(states)
        return Draws(*(np.stack(parts) for parts in zip(*drawn, strict=True)))

    def rewhiten(self, vectors: Float[np.ndarray, "chain draw n"], layout: Layout) -> None:
        """Whiten by what the chains have drawn up to now."""
        self._white, last = rewhiten(self._white, vectors, layout, self._data)
        self._states = [self._restarted(*one) for one in zip(self._states, last, strict=True)]

    def _restarted(self, state: Any, z: Float[np.ndarray, " smooth"]) -> Any:
        """The chain at whitened coordinates `z`, to adapt its step anew."""
        return state._replace(
            z=jnp.asarray(z),
            fresh=jnp.asarray(False),
            adaptation=readapting(state.adaptation),
        )

    @property
    def adapted_step(self) -> float:
        """The geometric mean of the steps to which the chains have adapted."""
        steps = [adapted_step(state.adaptation) for state in self._states]
        return float(np.exp(np.mean(np.log(steps))))


class _GuidedChains(_Chains):
    """Chains whose trajectories follow a surrogate."""

    def __init__(self, key: Array, layout: Layout, white: Whitening, data: Data, **others: Any):
        self._layout, self._key = layout, key
        self._surrogate = first_surrogate(key, white, layout, data)
        super().__init__(white=white, data=data, **others)

    def _begin(self, key: Array) -> GuidedState:
        with jax.enable_x64(True):
            state = self._kernel.start(key, self._white, self._data)
            return state._replace(predicted=predictions_at(state.vector, self._layout, self._data))

    def _advanced(
        self, state: GuidedState, step: Array, count: Array
    ) -> tuple[GuidedState, Transition]:
        return self._kernel.advance(state, self._white, self._surrogate, self._data, step, count)

    def _restarted(self, state: GuidedState, _: Float[np.ndarray, " smooth"]) -> GuidedState:
        """The chain where it is, to adapt its step anew."""
        return state._replace(adaptation=readapting(state.adaptation))

    def rewhiten(self, vectors: Float[np.ndarray, "chain draw n"], layout: Layout) -> None:
        super().rewhiten(vectors, layout)
        pooled = vectors.reshape(-1, vectors.shape[-1])
        self._surrogate = learned_surrogate(self._key, pooled, self._white, layout, self._data)


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

    Between the stages of warm-up the whitening is renewed by what all chains have seen. Each adapts
    its leapfrog step; after warm-up all take the geometric mean of these. Draws are made in rounds
    until the chains agree. Should transitions diverge, the draws are dropped and made again with
    shorter steps; those of the shortest are returned as they are. `preparation` is that of the layout
    and the data. `report(done, total)` is told of every CHUNK of iterations that a chain has done.
    """
    white = whitening(mode, layout, data)
    stage = effort.warmup // STAGES
    done, total = 0, effort.chains * (STAGES * stage + effort.draws)

    counting = Lock()  # chains count in threads of their own

    def advanced(count: int) -> None:
        nonlocal done
        with counting:
            done += count
            report(done, total)

    with ThreadPoolExecutor(workers) as pool:
        keys = [jax.random.fold_in(key, index) for index in range(effort.chains)]
        chains: _Chains = _GuidedChains(
            jax.random.fold_in(key, effort.chains),
            layout,
            white,
            data,
            keys=keys,
            kernel=preparation.guided,
            pool=pool,
            report=advanced,
        )
        for number in range(STAGES - 1):
            early = chains.advance(ADAPTING, stage)
            if number == 0 and early.acceptance[:, stage // 2 :].mean() < FAITHFUL:
                total += effort.chains * stage
                chains = _Chains(keys, white, preparation.kernel, data, pool, advanced)
                early = chains.advance(ADAPTING, stage)
            chains.rewhiten(early.vector[:, stage // 2 :], layout)
        for share in SHORTER:
            chains.advance(ADAPTING, stage)
            step, rounds = share * chains.adapted_step, []
            count = effort.draws
            while True:
                rounds.append(chains.advance(step, count))
                draws = Draws(*(np.concatenate(p, axis=1) for p in zip(*rounds, strict=True)))
                diverged = draws.diverging.any() and share != SHORTER[-1]
                if diverged or len(rounds) == effort.rounds or agree(draws, effort):
                    break
                count = max(effort.draws // 3, 1)
                total += effort.chains * count
            if not diverged:
                break
            total += effort.chains * (stage + effort.draws)
            chains.rewhiten(draws.vector, layout)
    return draws
