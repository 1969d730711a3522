"""Simulation-based calibration: posteriors of data drawn from the prior, against what was drawn."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jax
import numpy as np
import numpyro.distributions as dist
from jaxtyping import Array, Int
from scipy.stats import chisquare

from muscle_bayes.conventions import Friction
from muscle_bayes.data import read_runs
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.assemble import LIBRARIES, named_values, values_of
from muscle_bayes.inference.fit import FIT_LAYERS, fixture_prior, sample
from muscle_bayes.inference.posterior import Posterior
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.predict import disturbances
from muscle_bayes.inference.problem import Problem, pose
from muscle_bayes.inference.programs import potential_at, solved_at, unconstrained
from muscle_bayes.inference.sampler import Effort, agree
from muscle_bayes.parallel.tasks import Tasks
from muscle_bayes.provenance import source_checksum

EFFORT = Effort(chains=2, warmup=90, draws=150, rounds=16, min_ess=100, max_rhat=1.05)
"""Enough for RANKS nearly independent draws, and the R-hat that so few can be held to."""
RANKS = 99
"""Thinned draws of each posterior among which the truth is ranked."""
ATTEMPTS = 100
"""Draws of the prior tried for one that can be simulated."""
BINS = 10
"""Of the ranks, for the test of uniformity."""


@dataclass(frozen=True)
class Template:
    """What all data sets of a calibration share: rig, drive, times of readings and priors."""

    runs: tuple[Path, ...]
    """Logs from which these are taken; their readings fix the priors' centres and nothing else."""
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
        problem = pose(read_runs(list(self.runs)), self.friction, self.effects, self.known)
        if any(problem.layout.segmented):
            raise MuscleBayesError(
                "a run that nothing pulls back has free starts, of which no data set can be drawn; "
                "calibrate with runs of a spring, an arm or a muscle"
            )
        return problem


@double_precision
def replicate(problem: Problem, seed: int) -> tuple[dict[str, Array], Problem]:
    """Values drawn from the prior, and the problem with readings drawn from the likelihood there.

    The likelihood is zero where the model cannot be simulated, so such values are drawn again.
    Raises MuscleBayesError if none of ATTEMPTS draws can be.
    """
    layout, data = problem.layout, problem.data
    for attempt in range(ATTEMPTS):
        key = jax.random.fold_in(jax.random.key(seed), attempt)
        parts = jax.random.split(key, len(layout.shapes) + 1)
        values = {
            name: data.priors[name].sample(part)
            for part, (name, _) in zip(parts[1:], layout.shapes, strict=True)
        }
        vector = unconstrained(jax.tree.map(lambda x: x[None], values), layout, data)[0]
        found = solved_at(vector, layout, data).responses
        if not all(bool(one.finite.all()) for one in found):
            continue
        lanes = tuple(
            group._replace(
                reading=one.averaged
                + disturbances(jax.random.fold_in(parts[0], index), values, group, layout, regime)
            )
            for index, (group, one, regime) in enumerate(
                zip(data.lanes, found, layout.regimes, strict=True)
            )
        )
        drawn = replace(problem, data=data._replace(lanes=lanes))
        if np.isfinite(potential_at(vector, layout, drawn.data)):
            return values, drawn
    raise MuscleBayesError(f"none of {ATTEMPTS} draws of the prior can be simulated")


def _flat(values: Mapping[str, Any], lead: int) -> dict[str, np.ndarray]:
    """Scalar quantities by name, those of each run apart."""
    result = {}
    for name, value in values.items():
        value = np.asarray(value)
        if value.ndim == lead:
            result[name] = value
        else:
            for index in range(value.shape[-1]):
                result[f"{name}[{index}]"] = value[..., index]
    return result


@double_precision
def rank_data_set(template: Template, seed: int) -> dict[str, Any]:
    """Ranks of one data set's truth among draws of its posterior, for every quantity.

    A rank counts the thinned draws below the truth, 0 to RANKS. `converged` says whether the chains
    agreed; ranks of those that did not count all the same.
    """
    problem = template.problem()
    truth, drawn = replicate(problem, seed)
    drawn, draws, _ = sample(drawn, EFFORT, seed=seed, workers=1)
    posterior = _flat(named_values(drawn, values_of(draws, drawn)), 2)
    true = _flat(named_values(drawn, truth), 0)
    chains, count = draws.vector.shape[:2]
    chosen = np.linspace(0, chains * count - 1, RANKS).astype(int)
    ranks = {
        name: int(np.sum(posterior[name].reshape(-1)[chosen] < true[name])) for name in posterior
    }
    return {
        "ranks": ranks,
        "converged": agree(draws, EFFORT) and not bool(draws.diverging.any()),
        "divergences": int(draws.diverging.sum()),
    }


def calibration_tasks(template: Template, sets: int, seed: int) -> Tasks:
    """One task a data set; their results are those of `rank_data_set`.

    Raises MuscleBayesError for runs that cannot be read or be calibrated with.
    """
    template.problem()
    inputs = {
        "runs": {run.name: run.checksum for run in read_runs(list(template.runs))},
        "friction": template.friction,
        "effects": template.effects,
        "given": {name: [one.loc, one.scale] for name, one in (template.known or {}).items()},
        "effort": EFFORT,
        "source": source_checksum(*FIT_LAYERS),
        "ranks": RANKS,
        "versions": {name: version(name) for name in LIBRARIES},
    }
    arguments = {f"seed-{seed + number}": (template, seed + number) for number in range(sets)}
    return Tasks(rank_data_set, arguments, inputs)


@dataclass(frozen=True)
class Calibration:
    """Ranks of all data sets, and whether they are uniform."""

    ranks: Mapping[str, Int[np.ndarray, " set"]]
    converged: int
    """Data sets whose chains agreed."""

    @classmethod
    def of(cls, found: Sequence[Mapping[str, Any]]) -> "Calibration":
        """From the results of `rank_data_set`."""
        names = found[0]["ranks"]
        ranks = {name: np.array([one["ranks"][name] for one in found]) for name in names}
        return cls(ranks, sum(one["converged"] for one in found))

    @property
    def sets(self) -> int:
        """Number of data sets."""
        return len(next(iter(self.ranks.values())))

    def p_values(self) -> dict[str, float]:
        """Chi-square test of uniformity in BINS bins, for each quantity."""
        result = {}
        for name, ranks in self.ranks.items():
            counts = np.bincount(ranks * BINS // (RANKS + 1), minlength=BINS)
            result[name] = float(chisquare(counts).pvalue)
        return result

    def smallest(self) -> tuple[str, float]:
        """The least uniform quantity, and its p-value times the number of quantities (Bonferroni)."""
        values = self.p_values()
        name = min(values, key=lambda key: values[key])
        return name, min(1.0, values[name] * len(values))

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers."""
        name, chance = self.smallest()
        return {
            "sets": self.sets,
            "converged": self.converged,
            "least_uniform": {"name": name, "p_bonferroni": chance},
            "p": self.p_values(),
            "ranks": {name: ranks.tolist() for name, ranks in self.ranks.items()},
            "ranks_of": RANKS,
        }
