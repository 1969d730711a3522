"""Data sets drawn from a model: parameters from what is known before, readings from the likelihood."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import numpy as np
import numpyro.distributions as dist
from jaxtyping import Array, Float

from muscle_bayes.conventions import Friction
from muscle_bayes.data import read_runs
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.fit import fixture_prior, sample
from muscle_bayes.inference.posterior import Posterior
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.predict import disturbances
from muscle_bayes.inference.problem import Problem, pose
from muscle_bayes.inference.programs import constrained, potential_at, solved_at, unconstrained
from muscle_bayes.inference.sampler import Effort, agree

ATTEMPTS = 100
"""Draws of the parameters tried for one that can be simulated."""
KNOWN_EFFORT = Effort(min_ess=600)
"""Of the posterior from which parameters are drawn."""
KNOWN_DRAWS = 600
"""Draws that are kept of it."""


@dataclass(frozen=True)
class Template:
    """What all data sets of a calibration share: rig, drive, times of readings and priors."""

    runs: tuple[Path, ...]
    """Logs whose readings are redrawn; what was read fixes the priors' centres and nothing else."""
    friction: Friction = "coulomb"
    effects: tuple[str, ...] = ()
    given: Path | None = None
    """Posterior of a fixture, the prior of J and D."""
    after: tuple[Path, ...] = ()
    """Logs whose readings stay: parameters are drawn from the posterior that these give."""

    @property
    def source(self) -> str:
        """From what parameters are drawn, in words."""
        if not self.after:
            return "the prior"
        return "the posterior of " + ", ".join(path.stem for path in self.after)

    @property
    def known(self) -> dict[str, dist.Distribution] | None:
        """Priors of J and D from `given`."""
        if self.given is None:
            return None
        return fixture_prior(Posterior.load(self.given), self.friction)

    def problem(self) -> Problem:
        """The problem that the logs themselves pose."""
        runs = read_runs([*self.after, *self.runs])
        problem = pose(runs, self.friction, self.effects, self.known)
        if any(problem.layout.segmented):
            raise MuscleBayesError(
                "a run that nothing pulls back has free starts, of which no data set can be drawn; "
                "calibrate with runs of a spring, an arm or a muscle"
            )
        return problem

    def redrawn(self, problem: Problem) -> list[np.ndarray]:
        """Of each group of lanes, whether a lane's readings are redrawn."""
        names = {run.name for run in read_runs(list(self.runs))}
        return [
            np.array([problem.runs[index].name in names for index in owners])
            for owners in problem.lane_runs
        ]


def unread(problem: Problem, redrawn: list[np.ndarray]) -> Problem:
    """The problem with the readings that are redrawn not yet read."""
    lanes = tuple(
        group._replace(weight=np.where(which[:, None], 0.0, group.weight))
        for group, which in zip(problem.data.lanes, redrawn, strict=True)
    )
    return replace(problem, data=problem.data._replace(lanes=lanes))


@double_precision
def known_draws(template: Template, seed: int) -> dict[str, Any]:
    """Draws of everything unknown, unconstrained, from the posterior of the readings that stay.

    Unknowns of the runs that are redrawn follow their priors. `converged` as in `rank_data_set`.
    """
    problem = template.problem()
    blind = unread(problem, template.redrawn(problem))
    draws = sample(blind, KNOWN_EFFORT, seed=seed).draws
    every = draws.vector.reshape(-1, draws.vector.shape[-1])
    chosen = np.linspace(0, len(every) - 1, KNOWN_DRAWS).astype(int)
    return {
        "vectors": every[chosen].tolist(),
        "converged": agree(draws, KNOWN_EFFORT) and not bool(draws.diverging.any()),
    }


def _drawn(key: Array, problem: Problem, known: Float[np.ndarray, "draw n"] | None) -> Array:
    """An unconstrained vector, one of `known` or drawn from the prior."""
    layout, data = problem.layout, problem.data
    if known is not None:
        return known[int(jax.random.randint(key, (), 0, len(known)))]
    keys = jax.random.split(key, len(layout.shapes))
    values = {
        name: data.priors[name].sample(part, (1,))
        for part, (name, _) in zip(keys, layout.shapes, strict=True)
    }
    return unconstrained(values, layout, data)[0]


@double_precision
def replicate(
    template: Template,
    problem: Problem,
    seed: int,
    known: Float[np.ndarray, "draw n"] | None = None,
) -> tuple[dict[str, Array], Problem]:
    """Values drawn from the prior, or from `known`, and the problem with readings redrawn there.

    The likelihood is zero where the model cannot be simulated, so such values are drawn again.
    Raises MuscleBayesError if none of ATTEMPTS draws can be.
    """
    layout, data = problem.layout, problem.data
    redrawn = template.redrawn(problem)
    for attempt in range(ATTEMPTS):
        key = jax.random.fold_in(jax.random.key(seed), attempt)
        key_values, key_readings = jax.random.split(key)
        vector = _drawn(key_values, problem, known)
        found = solved_at(vector, layout, data).responses
        if not all(bool(one.finite.all()) for one in found):
            continue
        values = {k: v[0] for k, v in constrained(vector[None], layout, data).items()}
        lanes = []
        groups = zip(data.lanes, found, layout.regimes, redrawn, strict=True)
        for index, (group, one, regime, which) in enumerate(groups):
            key = jax.random.fold_in(key_readings, index)
            fresh = one.averaged + disturbances(key, values, group, layout, regime)
            reading = np.where(which[:, None], fresh, group.reading)
            lanes.append(group._replace(reading=reading))
        drawn = replace(problem, data=data._replace(lanes=tuple(lanes)))
        if np.isfinite(potential_at(vector, layout, drawn.data)):
            return values, drawn
    raise MuscleBayesError(f"none of {ATTEMPTS} draws of the parameters can be simulated")
