"""Chains that advance side by side by NumPyro's MCMC."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro import distributions as dist
from numpyro.infer import MCMC, Gibbs
from numpyro.infer.gibbs import GibbsState
from numpyro.util import identity

from muscle_bayes.inference.model.calibration_model import CalibrationModel
from muscle_bayes.inference.model.density import constrain
from muscle_bayes.inference.model.problem import Data, Problem
from muscle_bayes.inference.running.programs import constrained
from muscle_bayes.inference.running.side_by_side import side_by_side
from muscle_bayes.inference.sampling.draws import Draws, worst_rhat
from muscle_bayes.inference.sampling.kernels import SCHEDULE, Sampler
from muscle_bayes.inference.sampling.normal import (
    dispersed,
    entries_of,
    normal_at,
    normal_of_typical,
)
from muscle_bayes.inference.search.mode import Mode


class _Rows(NamedTuple):
    """What draws of one chain leave."""

    z: dict[str, Array]
    """As the kernel's blocks hold them."""
    statistics: dict[str, Array]


@partial(jax.jit, static_argnums=(0, 1, 2))
def _advance(
    kernel: Gibbs, sampler: Sampler, count: int, state: GibbsState, data: Data
) -> tuple[GibbsState, _Rows]:
    """`count` draws of one chain by `numpyro.infer.MCMC`.

    Compiled as a whole, for `MCMC.run` alone compiles its loop anew at every call.
    """
    mcmc = MCMC(
        kernel, num_warmup=0, num_samples=count, progress_bar=False, postprocess_fn=identity
    )
    mcmc.post_warmup_state = state
    last = len(state.block_states) - 1
    fields = {name: f"block_states.{last}.{key}" for name, key in sampler.statistics.items()}
    mcmc.run(state.rng_key, data, extra_fields=tuple(fields.values()))
    found = mcmc.get_extra_fields()
    statistics = {name: found[field] for name, field in fields.items()}
    return mcmc.last_state, _Rows(mcmc.get_samples(), statistics)


_KERNELS: dict[Any, Gibbs] = {}


def _kernel(problem: Problem, sampler: Sampler) -> Gibbs:
    """Made once for all problems that share compiled code."""
    names = tuple(run.name for run in problem.runs)
    key = problem.layout, problem.lane_runs, names, jax.tree.structure(problem.data), sampler
    if key not in _KERNELS:
        _KERNELS[key] = sampler.kernel(CalibrationModel(problem))
    return _KERNELS[key]


def _begin(
    key: Array,
    kernel: Gibbs,
    mode: Mode,
    problem: Problem,
    sampler: Sampler,
    chains: int,
    workers: int,
) -> list[GibbsState]:
    """First states of all chains: about the mode, as wide as its Fisher information."""
    layout, data = problem.layout, problem.data
    smooth = sampler.blocks(layout).smooth
    prepared = sampler.prepared(normal_at(mode, layout, smooth), problem, workers)
    rng = np.random.default_rng(np.asarray(jax.random.key_data(key)))

    @jax.jit
    def first(key: Array, place: Array, data: Data) -> GibbsState:
        values = constrain(place, layout, data)
        if not sampler.constrained:
            values |= {
                name: dist.biject_to(data.priors[name].support).inv(values[name]) for name in smooth
            }
        # The first sweep computes the density: none is needed here, and none is compiled.
        return kernel.init(key, SCHEDULE, values, (data,), {"predict": False})

    states = []
    for key_chain in jax.random.split(key, chains):
        place = dispersed(rng, mode, entries_of(smooth, layout), problem)
        state = first(key_chain, jnp.asarray(place), data)
        states.append(_with_last(state, sampler.begun(state.block_states[-1], prepared)))
    return states


def _with_last(state: GibbsState, block: Any) -> GibbsState:
    """The state with another one of its last block."""
    return state._replace(block_states=(*state.block_states[:-1], block))


def _placed(states: list[GibbsState]) -> list[GibbsState]:
    """The states on a device, as those that compiled code returns: the same code then serves them."""
    return jax.device_put(states, jax.devices()[0])


class Chains:
    """Chains side by side, and what they drew."""

    def __init__(
        self,
        key: Array,
        mode: Mode,
        problem: Problem,
        sampler: Sampler,
        *,
        count: int,
        planned: int,
        chunk: int,
        workers: int,
        report: Callable[[int, int, str], None],
    ) -> None:
        self._kernel = _kernel(problem, sampler)
        states = _begin(key, self._kernel, mode, problem, sampler, count, workers)
        self._states = _placed(states)
        self._sampler, self._problem, self._chunk = sampler, problem, chunk
        self._workers, self._report = workers, report
        self._done, self._planned = 0, planned
        self._rows: list[list[_Rows]] = []
        report(0, self._planned, "compiling")

    def warm_up(self, count: int) -> None:
        """Drop so many draws, and adapt to them."""
        if self._sampler.recentred:
            self._advance(count // 2, lambda: "warm-up")
            self._recentre()
            count -= count // 2
        self._advance(count, lambda: "warm-up")
        statistics = _joined(self._rows).statistics
        self._change_last(lambda block: self._sampler.warmed(block, statistics))
        self._rows = []

    def _recentre(self) -> None:
        """Drop what was drawn, and begin about a typical point of it."""
        vectors = self._drawn().vector
        typical = vectors[:, vectors.shape[1] // 2 :].mean((0, 1))
        smooth = self._sampler.blocks(self._problem.layout).smooth
        normal = normal_of_typical(typical, self._problem, smooth)
        prepared = self._sampler.prepared(normal, self._problem, self._workers)
        self._change_last(lambda block: self._sampler.begun(block, prepared))
        self._rows = []

    def _change_last(self, change: Callable[[Any], Any]) -> None:
        """Change the last block's state of all chains."""
        states = [_with_last(one, change(one.block_states[-1])) for one in self._states]
        self._states = _placed(states)

    def go_on(self, count: int) -> Draws:
        """All draws, after so many more."""
        self._advance(count, lambda: _note(self._drawn()))
        return self._drawn()

    def _drawn(self) -> Draws:
        return _draws(self._rows, self._problem, self._sampler)

    def _advance(self, count: int, note: Callable[[], str]) -> None:
        for _ in range(-(-count // self._chunk)):
            # The first chain compiles what the others share.
            alone = [self._one(self._states[0])] if self._done == 0 else []
            rest = self._states[len(alone) :]
            results = [*alone, *side_by_side(self._one, rest, self._workers)]
            self._states = [state for state, _ in results]
            self._rows.append([rows for _, rows in results])
            self._done += self._chunk
            self._report(self._done, max(self._planned, self._done), note())

    def _one(self, state: GibbsState) -> tuple[GibbsState, _Rows]:
        state, rows = _advance(self._kernel, self._sampler, self._chunk, state, self._problem.data)
        return state, jax.device_get(rows)


def _joined(chunks: list[list[_Rows]]) -> _Rows:
    """Draws of all chains, chain and draw axes leading."""
    chains = [jax.tree.map(lambda *x: np.concatenate(x), *own) for own in zip(*chunks, strict=True)]
    return jax.tree.map(lambda *x: np.stack(x), *chains)


def _draws(chunks: list[list[_Rows]], problem: Problem, sampler: Sampler) -> Draws:
    values, statistics = _joined(chunks)
    vector = sampler.vectors(values, statistics, problem)
    return Draws(vector, _sampled(vector, problem, len(chunks)), statistics)


def _sampled(
    vector: Float[np.ndarray, "chain draw n"], problem: Problem, chunks: int
) -> Float[np.ndarray, "chain draw n"]:
    """The quantities of unconstrained draws, chunk after chunk: one program serves any number."""
    found = []
    for piece in np.split(vector, chunks, axis=1):
        flat = piece.reshape(-1, piece.shape[2])
        values = constrained(flat, problem.layout, problem.data)
        whole = [np.asarray(value).reshape(*piece.shape[:2], -1) for value in values.values()]
        found.append(np.concatenate(whole, axis=2))
    return np.concatenate(found, axis=1)


def _note(draws: Draws) -> str:
    """How the chains do so far, for whoever follows the progress."""
    return f"{draws.divergences} divergences, R-hat {worst_rhat(draws):.3f}"
