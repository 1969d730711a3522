"""Draws from a posterior, in rounds until the chains agree."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import starmap

import arviz as az
from jaxtyping import Array

from muscle_bayes.inference.model.density import unconstrain
from muscle_bayes.inference.model.muscle_prior import MINIMUM_FORCES
from muscle_bayes.inference.model.problem import Problem
from muscle_bayes.inference.running.programs import constrained_at, potential_at
from muscle_bayes.inference.sampling.chains import Chains
from muscle_bayes.inference.sampling.draws import Draws, worst_rhat
from muscle_bayes.inference.sampling.gibbs_blocks import Slices
from muscle_bayes.inference.sampling.kernels import LinearisedSteps, Nuts, Sampler
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
    sampler: Sampler | None = None
    """How sites are sampled. None: by `LinearisedSteps`; where chains of it are still far from each other
    after the first draws, by it with effects sliced, or by `Nuts`."""
    far_apart: float = 1.3
    """R-hat of the first draws above which another sampler is tried."""
    most_divergent: float = 0.02
    """Share of their transitions that may diverge, else it is, too."""
    hopeless: float = 2.0
    """R-hat above which sampling may end early; see `patience`."""
    patience: float = 8.0
    """It then does where it would need so many times the most draws at the pace so far."""
    chunk: int = 25
    """Draws between two reports of progress."""


def agree(draws: Draws, effort: Effort) -> bool:
    """Whether rank-normalised R-hat and bulk ESS of every sampled quantity are good enough."""
    return worst_rhat(draws) <= effort.max_rhat and _least_ess(draws) >= effort.min_ess


def out_of_reach(draws: Draws, effort: Effort) -> bool:
    """Whether chains that are far apart gather effective draws much too slowly to agree in the end."""
    most = effort.draws + effort.rounds * (effort.draws // 2)
    needed = draws.values.shape[1] * effort.min_ess / _least_ess(draws)
    return worst_rhat(draws) > effort.hopeless and needed > effort.patience * most


def _least_ess(draws: Draws) -> float:
    return float(az.ess(az.convert_to_datatree({"v": draws.values}).posterior)["v"].min())


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

    def begin(number: int, sampler: Sampler) -> Chains:
        which = f"sampler {number}, " if number > 1 else ""
        return Chains(
            key,
            mode,
            problem,
            sampler,
            count=effort.chains,
            planned=effort.warmup + effort.draws,
            chunk=effort.chunk,
            workers=workers,
            report=lambda done, total, note: report(done, total, which + note),
        )

    samplers = [effort.sampler] if effort.sampler else _samplers(problem, mode)
    draws, chains = first_to_mix(starmap(begin, enumerate(samplers, 1)), effort)
    for _ in range(effort.rounds):
        if agree(draws, effort) or out_of_reach(draws, effort):
            break
        draws = chains.go_on(effort.draws // 2)
    return draws


def first_to_mix(tried: Iterable[Chains], effort: Effort) -> tuple[Draws, Chains]:
    """First draws, and the chains that go on: the first that come near each other, or else the nearest.

    Chains of which many transitions diverge miss a part of the posterior, however near they are.
    """
    begun = []
    for chains in tried:
        chains.warm_up(effort.warmup)
        draws = chains.go_on(effort.draws)
        diverged = draws.divergences > effort.most_divergent * draws.values[..., 0].size
        begun.append((diverged, worst_rhat(draws), draws, chains))
        if not diverged and begun[-1][1] <= effort.far_apart:
            break
    *_, draws, chains = min(begun, key=lambda one: one[:2])
    return draws, chains


def _samplers(problem: Problem, mode: Mode) -> list[Sampler]:
    """In the order in which they are tried. NUTS is good at swings, and often diverges on slow motion.

    Effects and the model's own parameters pay for one another in part. Such posteriors are less normal,
    so the smooth sites are given more steps a draw, and the walls fewer.
    """
    layout, walls = problem.layout, walls_at(mode, problem)
    nuts = Nuts(walls=walls)
    if not layout.effects:
        return [LinearisedSteps(walls=walls), nuts]
    longer = LinearisedSteps(walls=walls, steps=16, slices=Slices(wall_rounds=1, noise_rounds=2))
    apart = LinearisedSteps(walls=walls + tuple(layout.effects))
    return [longer, apart, nuts] if "slow" in layout.regimes else [longer, nuts, apart]


def walls_at(mode: Mode, problem: Problem, *, least_cost: float = 50.0) -> tuple[str, ...]:
    """The minimum forces about which the readings do not decide.

    A force counts as decided where halving it, all else as at the mode, costs more than `least_cost`
    nats: a spring then opens inside the records and its force is known as well as any other site, and
    together with others. Slices, which keep all others, would hardly move it.
    """
    layout, data = problem.layout, problem.data
    values = constrained_at(mode.vector, layout, data)

    def cost(name: str) -> float:
        halved = unconstrain(values | {name: 0.5 * values[name]}, layout, data)
        return potential_at(halved, layout, data) - mode.potential

    return tuple(name for name in MINIMUM_FORCES if name in values and not cost(name) > least_cost)
