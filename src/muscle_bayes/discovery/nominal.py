"""The most probable model without any candidate: where discovery starts from."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import norm

from muscle_bayes.conventions import Friction
from muscle_bayes.data.run import MIN_ROWS, Run
from muscle_bayes.discovery.fit import Search
from muscle_bayes.discovery.fitted import Fitted, Start, sampled_values
from muscle_bayes.inference.model.problem import Data, Problem, pose
from muscle_bayes.inference.posteriors.starts import SETTLING_SHARE
from muscle_bayes.inference.running.programs import constrained_at
from muscle_bayes.inference.search.mode import find_mode
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.pivots import pivoted

TOLERATED = {"slow": 0.15, "fast": 0.3, "imposed": 0.3, "heated": 0.3}
"""Lasting misfit that counts as none, in standard deviations of a reading's noise: temperatures between
readings are guessed, and rounding biases the readings of a rotor at rest."""


def noise_of_reading(
    run: Run, *, kept: float = 0.99, enough: int = 300, share: float = 0.2
) -> float:
    """White noise of one reading besides rounding [the log's unit], from third differences.

    A reading's third difference has 20 times its variance. The share `kept` of them counts, for elsewhere
    the rotor jumps. What rounding adds, a twelfth of the squared resolution, is taken off. All this holds
    where readings pass over steps: if `enough` rows do, and this `share` of all, those of a rotor at rest
    do not count, and what the kept part of a normal law's variance leaves out is made up for.
    """
    reading, step = run.table["reading"].to_numpy(), run.output_sensor.resolution
    third, trimmed = np.abs(np.diff(reading, 3)), 1.0
    if np.sum(passing := _passes(reading, 2.0 * step)) >= max(enough, share * third.size):
        third, edge = third[passing], norm.ppf(0.5 + 0.5 * kept)
        trimmed = 1.0 - 2.0 * edge * norm.pdf(edge) / kept
    inside = third[third <= np.quantile(third, kept)] if third.size else np.zeros(1)
    variance, rounding = np.mean(inside**2) / 20.0 / trimmed, step**2 / 12.0
    return float(np.sqrt(max(variance - rounding, 0.04 * rounding, 1e-24)))


def _passes(
    reading: Float[np.ndarray, " row"], least: float, reach: int = 4
) -> Bool[np.ndarray, " difference"]:
    """Third differences between whose sides the mean of `reach` readings changes by at least so much."""
    passing = np.zeros(max(reading.size - 3, 0), bool)
    if passing.size > 2 * reach:
        sums = np.cumsum(np.append(0.0, reading))
        mean = (sums[reach:] - sums[:-reach]) / reach
        passing[reach:-reach] = np.abs(mean[2 * reach :] - mean[: -2 * reach]) >= least
    return passing


def noise_by_regime(problem: Problem) -> dict[str, float]:
    """Median noise of a reading over the runs of each regime [the log's unit]."""
    levels: dict[str, dict[int, float]] = {}
    for regime, owners in zip(problem.layout.regimes, problem.lane_runs, strict=True):
        for owner in owners:
            levels.setdefault(regime, {})[owner] = noise_of_reading(problem.runs[owner])
    return {regime: float(np.median(list(found.values()))) for regime, found in levels.items()}


def nominal(
    runs: Sequence[Run],
    friction: Friction,
    effects: Sequence[str],
    candidates: Sequence[str],
    hold_out: Sequence[str] = (),
    seed: int = 0,
    **more: Any,
) -> tuple[Search, Fitted]:
    """The model that holds all candidates, and the fit without any, with its own motion.

    Runs in `hold_out` count with their first part only, which tells their own start. `more` goes to Search.
    """
    problem = pose(runs, friction, effects)
    seen = without_runs(problem, problem.data, hold_out)
    workers = more.get("workers", 1)
    mode = find_mode(
        jax.random.key(seed), problem.layout, seen, workers=workers, most_starts=16, agreeing=(3, 6)
    )
    data = pivoted(mode.vector, problem.layout, seen)
    values = constrained_at(mode.vector, problem.layout, data)
    posed = pose(runs, friction, (*effects, *candidates))
    noise = noise_by_regime(posed)
    tolerated = {regime: TOLERATED[regime] * level for regime, level in noise.items()}
    whole = replace(posed, data=posed.data._replace(lanes=problem.data.lanes))
    search = Search(Nested(whole, tolerated), noise, seed, tuple(hold_out), **more)
    point = search.nested.point(values, effects)
    start = Start(tuple(effects), point, posed.data._replace(lanes=data.lanes))
    (fitted,) = search.fit([start])
    return search, search.settled(fitted)


def nest(
    search: Search, effects: Sequence[str], fits: Sequence[Fitted], slots: int
) -> tuple[Search, list[Fitted]]:
    """The search in a model with these effects instead of its candidates, and fits carried over to it.

    A point has so many `slots`: with enough for every model to come, one program serves them all.
    """
    nested, problem = search.nested, search.nested.problem
    posed = pose(problem.runs, problem.layout.friction, tuple(effects))
    data = posed.data._replace(lanes=problem.data.lanes)
    other = Nested(replace(posed, data=data), nested.least, slots)
    starts = [
        Start(
            one.effects,
            other.point(sampled_values(nested, one), one.effects),
            posed.data._replace(lanes=one.data.lanes),
        )
        for one in fits
    ]
    inner = replace(search, nested=other)
    return inner, inner.fit(starts, steps=0)


def without_runs(problem: Problem, data: Data, names: Collection[str]) -> Data:
    """The data with only the first SETTLING_SHARE of these runs, which tells their own starts."""
    lanes = []
    for group, owners in zip(data.lanes, problem.lane_runs, strict=True):
        runs = [problem.runs[owner] for owner in owners]
        ends = [SETTLING_SHARE * r.duration if r.name in names else np.inf for r in runs]
        seen = group.time <= jnp.asarray(ends)[:, None]
        lanes.append(group._replace(weight=jnp.where(seen, group.weight, 0.0)))
    return data._replace(lanes=tuple(lanes))


def error_of_reading(search: Search) -> Float[np.ndarray, " error"]:
    """Noise and rounding of the mean reading of each interval [the log's unit]."""
    nested, parts = search.nested, []
    for lanes, regime in zip(nested.data.lanes, nested.layout.regimes, strict=True):
        weight, quantum = np.asarray(lanes.weight), np.asarray(lanes.quantum)[:, None]
        rounding = quantum**2 * np.asarray(lanes.coarse)
        mean = np.sqrt(search.noise[regime] ** 2 / np.maximum(weight, 1.0) + rounding)
        parts.append(mean.ravel())
    return np.concatenate(parts)


def seen_parts(runs: Sequence[Run], hold_out: Collection[str]) -> list[Run]:
    """The runs as a search sees them: of those held out the first part, if it has rows enough."""
    seen = []
    for run in runs:
        end = SETTLING_SHARE * run.duration
        if run.name not in hold_out:
            seen.append(run)
        elif (run.table["time"] < end).sum() >= MIN_ROWS:
            seen.append(run.until(end))
    return seen
