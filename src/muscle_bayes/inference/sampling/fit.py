"""Fitting runs: mode, chains, posterior."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float
from numpyro import distributions as dist

from muscle_bayes.conventions import Friction
from muscle_bayes.data.run import Run, refuse_unread
from muscle_bayes.errors import MuscleBayesError, refuse_all_but
from muscle_bayes.inference.model.problem import Problem, pose
from muscle_bayes.inference.model.reduction import (
    solved_adequately,
    unsolved,
    with_likely_inertia,
)
from muscle_bayes.inference.posteriors.assemble import assemble
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.records.open_delay import with_open_delay
from muscle_bayes.inference.running.blas import one_blas_thread
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.running.programs import constrained_at
from muscle_bayes.inference.sampling.draws import Draws
from muscle_bayes.inference.sampling.sampler import Effort, draw
from muscle_bayes.inference.search.mode import Mode, find_mode, refine
from muscle_bayes.inference.search.pivots import pivoted
from muscle_bayes.physics.effects.own import AnyEffectType, effect_names

QUICK = Effort(warmup=50, draws=100, rounds=24, min_ess=200)
FULL = Effort()
EFFORTS = {"quick": QUICK, "full": FULL}
MOST_INFORMATION = 1.0 / np.finfo(float).eps
"""Fisher information on an unconstrained entry, about 1 in the prior, that no readings give. Derivatives
that grow from step to step, of a motion that is bounded, give more long before they overflow."""


def fixture_prior(given: Posterior, friction: Friction) -> dict[str, dist.Distribution]:
    """Log-normal priors of J and D with the moments of an earlier posterior's logarithms."""
    refuse_all_but(Posterior, given, "given", "load one, as in mb.load('fixture.nc')")
    if given.friction != friction:
        raise MuscleBayesError(
            f"the given posterior has {given.friction} friction, this fit {friction}; "
            "its D means another thing. Fix: give one of the same friction."
        )
    group = given.tree["posterior"]
    logs = {name: np.log(group[name].to_numpy()) for name in ("J", "D") if name in group}
    return {name: dist.LogNormal(log.mean(), log.std()) for name, log in logs.items()}


def _improved(problem: Problem, mode: Mode) -> tuple[Problem, Mode]:
    """The problem with what only a mode can tell, segments' pivots and which runs need inertia.

    And its mode. Runs whose full inertia has no derivative there stay without.
    """
    data = pivoted(mode.vector, problem.layout, problem.data)
    reduced = replace(problem, data=data)
    mode = mode._replace(vector=with_likely_inertia(reduced, mode.vector))
    whole = solved_adequately(reduced, constrained_at(mode.vector, problem.layout, data))
    if whole.data is not reduced.data:
        found = refine(mode, whole.layout, whole.data)
        if _told_by_readings(found.information):
            return whole, found
        whole = replace(reduced, reduction=unsolved(whole.reduction))
    if whole.data is not problem.data:
        mode = refine(mode, whole.layout, whole.data)
    return whole, mode


def _told_by_readings(information: Float[np.ndarray, "n n"]) -> bool:
    """Whether it is of derivatives that mean something (False for NaN)."""
    return bool(np.all(np.abs(information) < MOST_INFORMATION))


class Sampled(NamedTuple):
    """Draws from a problem's posterior."""

    problem: Problem
    """As it was solved: with pivots and, where it matters, with inertia."""
    draws: Draws
    seconds: dict[str, float]
    """Wall time of each stage."""


@double_precision
@one_blas_thread
def sample(
    problem: Problem,
    effort: Effort,
    *,
    seed: int = 0,
    workers: int = 2,
    report: Callable[[str, int, int], None] = lambda stage, done, total: None,
) -> Sampled:
    """Draws from a problem's posterior; see `fit`. `workers` chains advance side by side."""
    begun = perf_counter()
    keys = jax.random.split(jax.random.key(seed), 2)

    def searched(done: int, total: int) -> None:
        report("searching", done, total)

    mode = find_mode(keys[0], problem.layout, problem.data, searched, workers)
    problem, mode = _improved(problem, mode)
    report("searching", 1, 1)
    found = perf_counter()
    drawn = draw(
        keys[1],
        mode,
        problem,
        effort,
        workers=workers,
        report=lambda done, total, note: report(f"sampling; {note}", done, total),
    )
    seconds = {"searching": found - begun, "sampling": perf_counter() - found}
    return Sampled(problem, drawn, seconds)


@double_precision
@one_blas_thread
def fit(
    runs: Sequence[Run],
    friction: Friction = "coulomb",
    effects: Sequence[str | AnyEffectType] = (),
    *,
    effort: Effort = FULL,
    given: Posterior | None = None,
    priors: Mapping[str, dist.Distribution] | None = None,
    seed: int = 0,
    report: Callable[[str, int, int], None] = lambda stage, done, total: None,
) -> Posterior:
    """Posterior of everything that is unknown about these runs.

    `given` is an earlier posterior of the fixture: its J and D become this fit's prior. `priors`
    replaces others by name, also by those of Table 2 (`calibration_model`). Where metadata
    leave the thermometer's delay uncertain, `clock-offset` is among the effects.
    `report(stage, done, total)` follows the progress. Raises MuscleBayesError for runs that cannot
    be fitted together or simulated; poor convergence is told by `converged` and `complaints`.
    """
    refuse_unread(runs)
    effects = with_open_delay(runs, effect_names(effects))
    if given is not None:
        priors = {**fixture_prior(given, friction), **(priors or {})}
    problem = pose(runs, friction, effects, priors)
    sampled = sample(problem, effort, seed=seed, report=report)
    report("predicting", 0, 1)
    begun = perf_counter()
    posterior = assemble(sampled.problem, sampled.draws, effort.min_ess, seed)
    seconds = sampled.seconds | {"predicting": perf_counter() - begun}
    posterior.tree.attrs["seconds"] = json.dumps({k: round(v, 3) for k, v in seconds.items()})
    report("predicting", 1, 1)
    return posterior
