"""Draws from a posterior by NumPyro's kernels, in rounds until the chains agree."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import arviz as az
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import biject_to
from numpyro.infer import Gibbs
from numpyro.infer.gibbs import GibbsState

from muscle_bayes.inference.model.calibration_model import CalibrationModel
from muscle_bayes.inference.model.density import constrain
from muscle_bayes.inference.model.problem import Data, Layout, Problem
from muscle_bayes.inference.running.programs import potential_at
from muscle_bayes.inference.running.side_by_side import side_by_side
from muscle_bayes.inference.sampling.gibbs_blocks import Slices, blocks_of, gibbs_kernel
from muscle_bayes.inference.search.factored import FactoredPrecision
from muscle_bayes.inference.search.mode import Mode

MAX_RHAT = 1.01
RHAT_MARGIN = 5e-4
"""What R-hat of the sampled quantities may exceed that of the unconstrained vector by: its folded part
is not the same after a transform."""
SCHEDULE = 1000
"""Warm-up that NumPyro is told of. Its first 75 draws adapt the step size alone and without a restart;
ours is shorter and ends there."""


@dataclass(frozen=True)
class Effort:
    """How long to sample."""

    chains: int = 4
    warmup: int = 100
    """Draws of each chain in which the step size is adapted; they are dropped."""
    draws: int = 200
    """Of each chain, before convergence is judged."""
    rounds: int = 40
    """Most rounds of draws; every one after the first makes a half as many."""
    min_ess: int = 400
    """Bulk effective sample size that is wanted of every sampled quantity."""
    max_rhat: float = MAX_RHAT
    """Largest R-hat with which chains count as agreeing. Its own scatter grows as draws get fewer."""
    slices: Slices = field(default_factory=Slices)
    chunk: int = 25
    """Draws between two reports of progress."""


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
    """Of the smooth block, the others given."""


def agree(draws: Draws, effort: Effort) -> bool:
    """Whether rank-normalised R-hat and bulk ESS of every entry of the vector are good enough.

    Bulk ESS is the same for an entry and for the sampled quantity that it stands for, R-hat nearly.
    """
    ess = az.ess(az.convert_to_datatree({"v": draws.vector}).posterior)["v"]
    return worst_rhat(draws) <= effort.max_rhat - RHAT_MARGIN and bool(ess.min() >= effort.min_ess)


def worst_rhat(draws: Draws) -> float:
    """The largest rank-normalised R-hat of the vector's entries."""
    return float(az.rhat(az.convert_to_datatree({"v": draws.vector}).posterior)["v"].max())


def _note(draws: Draws) -> str:
    """How the chains do so far, for whoever follows the progress."""
    return f"{int(draws.diverging.sum())} divergences, R-hat {worst_rhat(draws):.3f}"


class _Rows(NamedTuple):
    """What one draw leaves; `values` as the blocks hold them."""

    values: dict[str, Array]
    diverging: Array
    steps: Array
    acceptance: Array
    energy: Array
    potential: Array
    step_size: Array


@partial(jax.jit, static_argnums=(0, 1))
def _advance(kernel: Gibbs, count: int, state: GibbsState, data: Data) -> tuple[GibbsState, _Rows]:
    """`count` draws of one chain.

    As `numpyro.infer.MCMC` makes them, which compiles its loop anew at every call: rounds until the
    chains agree, and many data sets of the same shapes, ask for one that is compiled once.
    """

    def step(state: GibbsState, _: None) -> tuple[GibbsState, _Rows]:
        state = kernel.sample(state, (data,), {})
        nuts = state.block_states[1]
        rows = nuts.diverging, nuts.num_steps, nuts.accept_prob, nuts.energy, nuts.potential_energy
        return state, _Rows(state.z, *rows, nuts.adapt_state.step_size)

    return jax.lax.scan(step, state, None, length=count)


_KERNELS: dict[Any, Gibbs] = {}


def _kernel(problem: Problem, effort: Effort) -> Gibbs:
    """Made once for all problems that share compiled code."""
    names = tuple(run.name for run in problem.runs)
    structure = jax.tree.structure(problem.data)
    key = problem.layout, problem.lane_runs, names, structure, effort.slices
    if key not in _KERNELS:
        _KERNELS[key] = gibbs_kernel(CalibrationModel(problem), effort.slices)
    return _KERNELS[key]


def _begin(
    key: Array, kernel: Gibbs, mode: Mode, problem: Problem, effort: Effort
) -> list[GibbsState]:
    """First states of all chains: about the mode, as wide as its Fisher information."""
    layout, data = problem.layout, problem.data
    smooth = _smooth_entries(layout)
    information = np.asarray(mode.information)
    covariance = FactoredPrecision(information[np.ix_(smooth, smooth)]).inverse()
    rng = np.random.default_rng(np.asarray(jax.random.key_data(key)))
    blocks = blocks_of([name for name, _ in layout.shapes])

    @jax.jit
    def first(key: Array, place: Array, data: Data) -> GibbsState:
        values = constrain(place, layout, data)
        free = {
            name: biject_to(data.priors[name].support).inv(values[name]) for name in blocks.smooth
        }
        # The first sweep computes the density: none is needed here, and none is compiled.
        return kernel.init(key, SCHEDULE, values | free, (data,), {"predict": False})

    states = []
    for key_chain in jax.random.split(key, effort.chains):
        place = _dispersed(rng, mode, smooth, problem)
        state = first(key_chain, jnp.asarray(place), data)
        states.append(_with_covariance(state, blocks.smooth, covariance))
    # On a device, as later states are: compiled code then serves the first one too.
    return jax.device_put(states, jax.devices()[0])


def _with_covariance(
    state: GibbsState, names: tuple[str, ...], covariance: Float[np.ndarray, "n n"]
) -> GibbsState:
    """The state with a NUTS block of this inverse mass matrix."""
    sliced, nuts = state.block_states
    root = np.linalg.cholesky(np.linalg.inv(covariance))
    adapted = nuts.adapt_state._replace(
        inverse_mass_matrix={names: jnp.asarray(covariance)},
        mass_matrix_sqrt={names: jnp.asarray(root)},
        mass_matrix_sqrt_inv={names: jnp.asarray(np.linalg.inv(root))},
    )
    return state._replace(block_states=(sliced, nuts._replace(adapt_state=adapted)))


def _smooth_entries(layout: Layout) -> np.ndarray:
    """Entries of the unconstrained vector in the smooth block."""
    names = np.repeat(
        [name for name, _ in layout.shapes], [int(np.prod(shape)) for _, shape in layout.shapes]
    )
    return np.flatnonzero(np.isin(names, blocks_of(list(names)).smooth))


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
        mode: a maximum of the posterior density; its Fisher information is the mass matrix.
        problem: whose posterior is sampled.
        effort: how long.
        workers: chains that advance side by side.
        report: called with the draws of each chain done and planned, and a note on divergences and
            R-hat so far.
    """
    kernel = _kernel(problem, effort)
    states = _begin(key, kernel, mode, problem, effort)
    done, total = 0, effort.warmup + effort.draws

    def advance(count: int, before: list[list[_Rows]] | None = None) -> list[list[_Rows]]:
        """What each chain draws, chunk after chunk, behind those before; None warms up."""
        nonlocal done, states
        chunks = list(before or ())
        for _ in range(-(-count // effort.chunk)):

            def one(state: GibbsState) -> tuple[GibbsState, _Rows]:
                state, rows = _advance(kernel, effort.chunk, state, problem.data)
                return state, jax.device_get(rows)

            # The first chain compiles what the others share.
            alone = [one(states[0])] if done == 0 else []
            results = [*alone, *side_by_side(one, states[len(alone) :], workers)]
            states = [state for state, _ in results]
            chunks.append([rows for _, rows in results])
            done += effort.chunk
            note = "warm-up" if before is None else _note(_joined(chunks, problem))
            report(done, max(total, done), note)
        return chunks

    report(0, total, "compiling")
    warm = advance(effort.warmup)
    states = [_adapted(state, warm) for state in states]
    chunks = advance(effort.draws, [])
    for _ in range(effort.rounds):
        draws = _joined(chunks, problem)
        if agree(draws, effort):
            break
        total = done + effort.draws // 2
        chunks = advance(effort.draws // 2, chunks)
    return _joined(chunks, problem)


def _adapted(state: GibbsState, chunks: list[list[_Rows]]) -> GibbsState:
    """The state with the median step size that all chains took in the later half of warm-up."""
    later = chunks[len(chunks) // 2 :]
    size = np.exp(np.median([np.log(rows.step_size) for chunk in later for rows in chunk]))
    sliced, nuts = state.block_states
    adapted = nuts.adapt_state._replace(step_size=jnp.full_like(nuts.adapt_state.step_size, size))
    ended = nuts._replace(adapt_state=adapted, i=jnp.full_like(nuts.i, SCHEDULE))
    return state._replace(block_states=(sliced, ended))


def _joined(chunks: list[list[_Rows]], problem: Problem) -> Draws:
    chains = [jax.tree.map(lambda *x: np.concatenate(x), *own) for own in zip(*chunks, strict=True)]
    whole = jax.tree.map(lambda *x: np.stack(x), *chains)
    smooth = blocks_of([name for name, _ in problem.layout.shapes]).smooth
    columns = []
    for name, _ in problem.layout.shapes:
        value = whole.values[name]
        if name not in smooth:  # positive, and held as it is
            value = np.log(value)
        columns.append(value.reshape(*value.shape[:2], -1))
    vector = np.concatenate(columns, axis=2)
    return Draws(
        vector=vector,
        diverging=whole.diverging,
        steps=whole.steps,
        acceptance=whole.acceptance,
        energy=whole.energy,
        log_density=-whole.potential,
    )
