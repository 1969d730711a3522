"""Data sets drawn from a model: parameters from what is known before, readings from the likelihood."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro import distributions as dist

from muscle_bayes.conventions import Friction
from muscle_bayes.data import read_runs
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.problem import Problem, pose
from muscle_bayes.inference.model.reduction import with_inertia
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.posteriors.predict import disturbances
from muscle_bayes.inference.records.open_delay import with_open_delay
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.running.programs import (
    constrained,
    constrained_at,
    potential_at,
    solved_at,
    unconstrained,
)
from muscle_bayes.inference.sampling.fit import fixture_prior, sample
from muscle_bayes.inference.sampling.sampler import Effort, agree

ATTEMPTS = 200
"""Draws of the prior tried for one that can be simulated and moves."""
LEAST_SPAN = 0.3
"""Of every run's redrawn readings, in that of the measured ones; those of a rotor that sticks span less."""
KNOWN_EFFORT = Effort(min_ess=600)
"""Of the posterior from which parameters are drawn."""
KNOWN_DRAWS = 600
"""Draws that are kept of it."""


@dataclass(frozen=True)
class Template:
    """What all data sets of a calibration share: rig, drive, times of readings and priors."""

    runs: tuple[Path, ...]
    """Logs from which these are taken; readings fix the priors' centres."""
    friction: Friction = "coulomb"
    effects: tuple[str, ...] = ()
    given: Path | None = None
    """Posterior of a fixture, the prior of J and D."""

    @property
    def known(self) -> dict[str, dist.Distribution] | None:
        """Priors of J and D from `given`."""
        if self.given is None:
            return None
        return fixture_prior(Posterior.load(self.given), self.friction)

    def problem(self) -> Problem:
        """The problem that the logs themselves pose."""
        runs = read_runs(list(self.runs))
        problem = pose(runs, self.friction, with_open_delay(runs, self.effects), self.known)
        if any(problem.layout.segmented):
            raise MuscleBayesError(
                "a run that nothing pulls back has free starts, of which no data set can be drawn; "
                "calibrate with runs of a spring, an arm or a muscle"
            )
        return problem


class Known(NamedTuple):
    """Parameters for one data set, and the model of which they are a draw."""

    vector: Sequence[float]
    """Unconstrained."""
    inertial: Sequence[str] = ()
    """Slow runs that are solved with full inertia."""
    swings: Sequence[Any] | None = None
    """What inertia adds to the others, of every group of lanes (lane, interval) [log's unit]."""

    @classmethod
    def drawn(cls, measured: Mapping[str, Any], index: int) -> Self:
        """The draw of this index (modulo their number) in a result of `measured_draws`."""
        vectors = measured["vectors"]
        return cls(vectors[index % len(vectors)], measured["inertial"], measured["swings"])

    def model(self, problem: Problem) -> Problem:
        """The problem, solved as that was whose posterior was drawn from."""
        values = constrained_at(jnp.asarray(self.vector), problem.layout, problem.data)
        problem = with_inertia(problem, values, self.inertial)
        if self.swings is None:
            return problem
        groups = zip(problem.data.lanes, self.swings, strict=True)
        lanes = tuple(one._replace(swing=jnp.asarray(swing)) for one, swing in groups)
        return replace(problem, data=problem.data._replace(lanes=lanes))


@double_precision
def measured_draws(template: Template, seed: int) -> dict[str, Any]:
    """Draws from the posterior of the readings as they were measured, and how they were solved.

    `converged` as in `rank_data_set`, the other keys as in `Known`: readings drawn without what
    inertia adds to slow runs would not be of the model that has these draws.
    """
    solved, draws, _ = sample(template.problem(), KNOWN_EFFORT, seed=seed)
    every = draws.vector.reshape(-1, draws.vector.shape[-1])
    chosen = np.linspace(0, len(every) - 1, KNOWN_DRAWS).astype(int)
    return {
        "vectors": every[chosen].tolist(),
        "inertial": [name for name, error in solved.reduction.items() if not error.tolerable],
        "swings": [np.asarray(lanes.swing).tolist() for lanes in solved.data.lanes],
        "converged": agree(draws, KNOWN_EFFORT) and not draws.divergences,
    }


def _candidates(key: Array, problem: Problem, known: Known | None) -> Iterator[Float[Array, " n"]]:
    """Unconstrained vectors: the known one, else draws from the prior."""
    layout, data = problem.layout, problem.data
    if known is not None:
        yield jnp.asarray(known.vector)
        return
    for attempt in range(ATTEMPTS):
        keys = jax.random.split(jax.random.fold_in(key, attempt), len(layout.shapes))
        values = {
            name: data.priors[name].sample(part, (1,))
            for part, (name, _) in zip(keys, layout.shapes, strict=True)
        }
        yield unconstrained(values, layout, data)[0]


def _spans(reading: Array, weight: Array) -> Float[np.ndarray, " lane"]:
    """Range of each run's readings [log's unit]."""
    seen = np.where(np.asarray(weight) > 0, np.asarray(reading), np.nan)
    return np.asarray(np.nanmax(seen, axis=1) - np.nanmin(seen, axis=1))


@double_precision
def replicate(
    problem: Problem, seed: int, known: Known | None = None
) -> tuple[dict[str, Array], Problem]:
    """Values drawn from the prior, and the problem with readings redrawn there.

    `known` stands for values drawn before, unconstrained, from the posterior of the readings as
    measured, which then stay beside those that are redrawn. The likelihood is zero where the model
    cannot be simulated, so such values are drawn again. So are, without `known`, values and readings
    where any run's readings span less than LEAST_SPAN of the measured ones: of a rotor that sticks
    they tell nothing. Ranks stay uniform, for whether a data set counts depends on its readings
    alone. Raises MuscleBayesError if no draw of the prior, or not the known one, gives any.
    """
    if known is not None:
        problem = known.model(problem)
    layout, data = problem.layout, problem.data
    key_values, key_readings = jax.random.split(jax.random.key(seed))
    for attempt, vector in enumerate(_candidates(key_values, problem, known)):
        found = solved_at(vector, layout, data).responses
        if not all(bool(one.finite.all()) for one in found):
            continue
        values = {name: one[0] for name, one in constrained(vector[None], layout, data).items()}
        key_attempt = jax.random.fold_in(key_readings, attempt)
        lanes, moves = [], True
        for index, (group, one) in enumerate(zip(data.lanes, found, strict=True)):
            key = jax.random.fold_in(key_attempt, index)
            noise = disturbances(key, values, one.averaged, group, layout.regimes[index])
            again = one.averaged + noise
            least = LEAST_SPAN * _spans(group.reading, group.weight)
            moves = moves and bool(np.all(_spans(again, group.weight) >= least))
            lanes.append(
                group._replace(reading=again) if known is None else group._replace(again=again)
            )
        if known is None and not moves:
            continue
        drawn = replace(problem, data=data._replace(lanes=tuple(lanes)))
        if np.isfinite(potential_at(vector, layout, drawn.data)):
            return values, drawn
    if known is not None:
        raise MuscleBayesError(
            "a draw of the posterior of the runs as measured cannot be simulated again. Fix: "
            "look at that posterior first, with `muscle-bayes fit` and the same options"
        )
    raise MuscleBayesError(
        f"none of {ATTEMPTS} draws of the prior can be simulated and moves. Fix: calibrate about the "
        "runs as measured (--measured), or with J and D of an earlier fit (--given)"
    )
