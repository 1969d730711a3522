"""Simulation-based calibration: posteriors of drawn data, against the parameters that drew them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from time import process_time
from typing import Any

import numpy as np
from jaxtyping import Int
from scipy.stats import chisquare, kstest

from muscle_bayes.criticism.replicates import (
    KNOWN_EFFORT,
    LEAST_SPAN,
    Known,
    Template,
    measured_draws,
    replicate,
)
from muscle_bayes.inference.posteriors.assemble import named_values, values_of
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.sampling.fit import sample
from muscle_bayes.inference.sampling.sampler import Effort, agree
from muscle_bayes.parallel.tasks import Tasks
from muscle_bayes.provenance import LIBRARIES, code_checksum

EFFORT = Effort(chains=2, warmup=90, draws=150, rounds=16, min_ess=100, max_rhat=1.05)
"""Enough for RANKS nearly independent draws, and the R-hat that so few can be held to."""
RANKS = 99
"""Thinned draws of each posterior among which the truth is ranked."""
BINS = 10
"""Of the ranks, for the test of uniformity."""


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
def rank_data_set(template: Template, seed: int, known: Known | None = None) -> dict[str, Any]:
    """Ranks of one data set's truth among draws of its posterior, for every quantity.

    The truth is drawn from the prior, or is `known`, a draw of `measured_draws`. A rank
    counts the thinned draws below the truth, 0 to RANKS. `converged` says whether the chains
    agreed; ranks of those that did not count all the same. `seconds` are the processor's.
    """
    begun = process_time()
    truth, drawn = replicate(template.problem(), seed, known)
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
        "converged": agree(draws, EFFORT) and not draws.divergences,
        "divergences": draws.divergences,
        "seconds": process_time() - begun,
    }


def _inputs(template: Template, effort: Effort) -> dict[str, Any]:
    """What results depend on. Raises MuscleBayesError for runs that cannot be calibrated with."""
    return {
        "runs": {run.name: run.checksum for run in template.problem().runs},
        "friction": template.friction,
        "effects": template.effects,
        "given": {name: [one.loc, one.scale] for name, one in (template.known or {}).items()},
        "effort": effort,
        "source": code_checksum(__name__),
        "versions": {name: version(name) for name in LIBRARIES},
    }


def measured_task(template: Template, seed: int) -> Tasks:
    """A single task whose result is that of `measured_draws`."""
    arguments = {f"measured-{seed}": (template, seed)}
    return Tasks(measured_draws, arguments, _inputs(template, KNOWN_EFFORT))


def calibration_tasks(
    template: Template, sets: int, seed: int, measured: Mapping[str, Any] | None = None
) -> Tasks:
    """One task a data set; their results are those of `rank_data_set`.

    Each has a draw of `measured`, a result of `measured_draws`, for its truth if there is any. Raises
    MuscleBayesError for runs that cannot be read or be calibrated with.
    """
    inputs = _inputs(template, EFFORT) | {"ranks": RANKS, "known": measured, "span": LEAST_SPAN}
    arguments: dict[str, tuple[Any, ...]] = {}
    for one in range(seed, seed + sets):
        chosen = int(np.random.default_rng(one).integers(2**31))
        truth = None if measured is None else Known.drawn(measured, chosen)
        arguments[f"seed-{one}"] = (template, one, truth)
    return Tasks(rank_data_set, arguments, inputs)


@dataclass(frozen=True)
class Calibration:
    """Ranks of all data sets, and whether they are uniform."""

    source: str
    """From what the parameters were drawn."""
    ranks: Mapping[str, Int[np.ndarray, " set"]]
    converged: int
    """Data sets whose chains agreed."""
    seconds: float
    """Of processor time that all data sets took."""

    @classmethod
    def of(cls, found: Sequence[Mapping[str, Any]], source: str) -> "Calibration":
        """From the results of `rank_data_set`."""
        names = found[0]["ranks"]
        ranks = {name: np.array([one["ranks"][name] for one in found]) for name in names}
        converged, seconds = (sum(one[key] for one in found) for key in ("converged", "seconds"))
        return cls(source, ranks, converged, seconds)

    @property
    def sets(self) -> int:
        """Number of data sets."""
        return len(next(iter(self.ranks.values())))

    def p_values(self) -> dict[str, float]:
        """Of each quantity, that its ranks are uniform: twice the smaller of two tests' p-values.

        Chi-square in BINS bins sees a posterior too narrow or too wide, Kolmogorov and Smirnov's test one
        that leans to a side.
        """
        result = {}
        for name, ranks in self.ranks.items():
            counts = np.bincount(ranks * BINS // (RANKS + 1), minlength=BINS)
            leaning = kstest((ranks + 0.5) / (RANKS + 1), "uniform").pvalue
            result[name] = float(min(1.0, 2.0 * min(chisquare(counts).pvalue, leaning)))
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
            "source": self.source,
            "sets": self.sets,
            "converged": self.converged,
            "processor_seconds": self.seconds,
            "least_uniform": {"name": name, "p_bonferroni": chance},
            "p": self.p_values(),
            "ranks": {name: ranks.tolist() for name, ranks in self.ranks.items()},
            "ranks_of": RANKS,
        }
