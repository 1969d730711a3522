"""Draws from a posterior by NumPyro's MCMC, in rounds until the chains agree."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import arviz as az
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
from muscle_bayes.inference.model.problem import Data, Layout, Problem
from muscle_bayes.inference.running.programs import constrained, potential_at
from muscle_bayes.inference.running.side_by_side import side_by_side
from muscle_bayes.inference.sampling.gibbs_blocks import Slices, blocks_of
from muscle_bayes.inference.sampling.kernels import (
    SCHEDULE,
    CrankNicolsonSteps,
    Normal,
    Nuts,
    SmoothBlock,
    gibbs_kernel,
    smooth_state,
    statistics_of,
    with_smooth,
)
from muscle_bayes.inference.search.factored import FactoredPrecision
from muscle_bayes.inference.search.mode import Mode

MAX_RHAT = 1.01


@dataclass(frozen=True)
class Effort:
    """How long to sample, and how."""

    chains: int = 4
    warmup: int = 100
    """Draws of each chain that are dropped; NUTS adapts its step size in them."""
    draws: int = 200
    """Of each chain, before convergence is judged."""
    rounds: int = 40
    """Most rounds of draws; every one after the first makes a half as many."""
    min_ess: int = 400
    """Bulk effective sample size that is wanted of every sampled quantity."""
    max_rhat: float = MAX_RHAT
    """Largest R-hat with which chains count as agreeing. Its own scatter grows as draws get fewer."""
    smooth: SmoothBlock | None = None
    """How the smooth sites are sampled. None: by `CrankNicolsonSteps`, unless fewer than
    `least_acceptance` of their proposals are accepted in warm-up; then by `Nuts`."""
    least_acceptance: float = 0.3
    """With which the normal approximation at the mode counts as good."""
    slices: Slices = field(default_factory=Slices)
    chunk: int = 25
    """Draws between two reports of progress."""


class Draws(NamedTuple):
    """What the chains did after warm-up."""

    vector: Float[np.ndarray, "chain draw n"]
    """Unconstrained."""
    values: Float[np.ndarray, "chain draw n"]
    """The sampled quantities themselves."""
    statistics: dict[str, np.ndarray]
    """Of the smooth block, by ArviZ's names, chain and draw axes leading."""

    @property
    def divergences(self) -> int:
        """How many transitions diverged; none do without gradients."""
        return int(self.statistics.get("diverging", np.zeros(())).sum())


def agree(draws: Draws, effort: Effort) -> bool:
    """Whether rank-normalised R-hat and bulk ESS of every sampled quantity are good enough."""
    ess = az.ess(az.convert_to_datatree({"v": draws.values}).posterior)["v"]
    return worst_rhat(draws) <= effort.max_rhat and bool(ess.min() >= effort.min_ess)


def worst_rhat(draws: Draws) -> float:
    """The largest rank-normalised R-hat of the sampled quantities."""
    return float(az.rhat(az.convert_to_datatree({"v": draws.values}).posterior)["v"].max())


def _note(draws: Draws) -> str:
    """How the chains do so far, for whoever follows the progress."""
    return f"{draws.divergences} divergences, R-hat {worst_rhat(draws):.3f}"


class _Rows(NamedTuple):
    """What draws of one chain leave."""

    z: dict[str, Array]
    """As the kernel's blocks hold them."""
    statistics: dict[str, Array]


@partial(jax.jit, static_argnums=(0, 1, 2))
def _advance(
    kernel: Gibbs, smooth: SmoothBlock, count: int, state: GibbsState, data: Data
) -> tuple[GibbsState, _Rows]:
    """`count` draws of one chain by `numpyro.infer.MCMC`.

    Compiled as a whole, for `MCMC.run` alone compiles its loop anew at every call.
    """
    mcmc = MCMC(
        kernel, num_warmup=0, num_samples=count, progress_bar=False, postprocess_fn=identity
    )
    mcmc.post_warmup_state = state
    fields = statistics_of(smooth)
    mcmc.run(state.rng_key, data, extra_fields=tuple(fields.values()))
    found = mcmc.get_extra_fields()
    statistics = {name: found[field] for name, field in fields.items()}
    return mcmc.last_state, _Rows(mcmc.get_samples(), statistics)


_KERNELS: dict[Any, Gibbs] = {}


def _kernel(problem: Problem, smooth: SmoothBlock, slices: Slices) -> Gibbs:
    """Made once for all problems that share compiled code."""
    names = tuple(run.name for run in problem.runs)
    structure = jax.tree.structure(problem.data)
    key = problem.layout, problem.lane_runs, names, structure, smooth, slices
    if key not in _KERNELS:
        _KERNELS[key] = gibbs_kernel(CalibrationModel(problem), smooth, slices)
    return _KERNELS[key]


def _begin(
    key: Array, kernel: Gibbs, mode: Mode, problem: Problem, smooth: SmoothBlock, chains: int
) -> list[GibbsState]:
    """First states of all chains: about the mode, as wide as its Fisher information."""
    layout, data = problem.layout, problem.data
    entries = _smooth_entries(layout)
    blocks = blocks_of([name for name, _ in layout.shapes])
    normal = _normal(mode, entries, layout)
    rng = np.random.default_rng(np.asarray(jax.random.key_data(key)))

    @jax.jit
    def first(key: Array, place: Array, data: Data) -> GibbsState:
        values = constrain(place, layout, data)
        if not smooth.constrained:
            values |= {
                name: dist.biject_to(data.priors[name].support).inv(values[name])
                for name in blocks.smooth
            }
        # The first sweep computes the density: none is needed here, and none is compiled.
        return kernel.init(key, SCHEDULE, values, (data,), {"predict": False})

    states = []
    for key_chain in jax.random.split(key, chains):
        place = _dispersed(rng, mode, entries, problem)
        state = first(key_chain, jnp.asarray(place), data)
        states.append(with_smooth(state, smooth.begun(smooth_state(state), blocks.smooth, normal)))
    return states


def _placed(states: list[GibbsState]) -> list[GibbsState]:
    """The states on a device, as those that compiled code returns: the same code then serves them."""
    return jax.device_put(states, jax.devices()[0])


def _smooth_entries(layout: Layout) -> np.ndarray:
    """Entries of the unconstrained vector in the smooth block."""
    names = _entry_names(layout)
    return np.flatnonzero(np.isin(names, blocks_of(list(names)).smooth))


def _entry_names(layout: Layout) -> np.ndarray:
    sizes = [int(np.prod(shape)) for _, shape in layout.shapes]
    return np.repeat([name for name, _ in layout.shapes], sizes)


def _normal(mode: Mode, entries: np.ndarray, layout: Layout) -> Normal:
    """The normal approximation of the smooth sites."""
    covariance = FactoredPrecision(np.asarray(mode.information)[np.ix_(entries, entries)]).inverse()
    names = tuple(_entry_names(layout)[entries])
    return Normal(names, np.asarray(mode.vector)[entries], covariance)


def _dispersed(
    rng: np.random.Generator, mode: Mode, smooth: np.ndarray, problem: Problem
) -> Float[np.ndarray, " n"]:
    """A point about the mode, as wide as the Fisher information and not less likely than a draw.

    From a far less likely one the minimum forces would be driven where they stay for long.
    """
    away = FactoredPrecision(np.asarray(mode.information)).spread(
        rng.standard_normal(len(mode.vector))
    )
    for halving in range(8):
        place = np.array(mode.vector)
        place[smooth] += 0.5**halving * away[smooth]
        value = potential_at(jnp.asarray(place), problem.layout, problem.data)
        if value < mode.potential + place.size:
            return place
    return np.array(mode.vector)


class _Chains:
    """Chains side by side, and what they drew."""

    def __init__(
        self,
        key: Array,
        mode: Mode,
        problem: Problem,
        effort: Effort,
        smooth: SmoothBlock,
        workers: int,
        report: Callable[[int, int, str], None],
    ) -> None:
        self._kernel = _kernel(problem, smooth, effort.slices)
        self._states = _placed(_begin(key, self._kernel, mode, problem, smooth, effort.chains))
        self._smooth, self._problem, self._chunk = smooth, problem, effort.chunk
        self._workers, self._report = workers, report
        self._done, self._planned = 0, effort.warmup + effort.draws
        self._rows: list[list[_Rows]] = []
        report(0, self._planned, "compiling")

    def warm_up(self, count: int) -> float:
        """Drop so many draws, and adapt to them; their mean acceptance probability."""
        self._advance(count, lambda: "warm-up")
        statistics = _joined(self._rows).statistics
        self._states = _placed(
            [
                with_smooth(one, self._smooth.warmed(smooth_state(one), statistics))
                for one in self._states
            ]
        )
        self._rows = []
        rates = statistics["acceptance_rate"]
        return float(rates[:, rates.shape[1] // 2 :].mean())

    def go_on(self, count: int) -> Draws:
        """All draws, after so many more."""
        self._advance(count, lambda: _note(self._drawn()))
        return self._drawn()

    def _drawn(self) -> Draws:
        return _draws(self._rows, self._problem, self._smooth)

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
        state, rows = _advance(self._kernel, self._smooth, self._chunk, state, self._problem.data)
        return state, jax.device_get(rows)


def draw(
    key: Array,
    mode: Mode,
    problem: Problem,
    effort: Effort,
    *,
    workers: int = 2,
    report: Callable[[int, int, str], None] = lambda done, total, note: None,
) -> Draws:
    """Draws of several chains, each from its own dispersed start, in rounds until they agree.

    Args:
        key: random key.
        mode: a maximum of the posterior density, with its Fisher information.
        problem: whose posterior is sampled.
        effort: how long, and how.
        workers: chains that advance side by side.
        report: called with the draws of each chain done and planned, and a note on divergences and
            R-hat so far.
    """

    def begin(smooth: SmoothBlock) -> _Chains:
        return _Chains(key, mode, problem, effort, smooth, workers, report)

    chains = begin(effort.smooth or CrankNicolsonSteps())
    accepted = chains.warm_up(effort.warmup)
    if effort.smooth is None and accepted < effort.least_acceptance:
        chains = begin(Nuts())
        chains.warm_up(effort.warmup)
    draws = chains.go_on(effort.draws)
    for _ in range(effort.rounds):
        if agree(draws, effort):
            break
        draws = chains.go_on(effort.draws // 2)
    return draws


def _joined(chunks: list[list[_Rows]]) -> _Rows:
    """Draws of all chains, chain and draw axes leading."""
    chains = [jax.tree.map(lambda *x: np.concatenate(x), *own) for own in zip(*chunks, strict=True)]
    return jax.tree.map(lambda *x: np.stack(x), *chains)


def _draws(chunks: list[list[_Rows]], problem: Problem, smooth: SmoothBlock) -> Draws:
    values, statistics = _joined(chunks)
    sites = blocks_of(list(values)).smooth
    held = {name: np.asarray(values[name]) for name in sites}
    free = smooth.unconstrained(held, statistics)
    columns = []
    for name, _ in problem.layout.shapes:
        # The others are positive.
        value = free[name] if name in free else np.log(values[name])
        columns.append(value.reshape(*value.shape[:2], -1))
    vector = np.concatenate(columns, axis=2)
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
