"""Which effect is missing: a probability for each, for none, and for something unknown."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from muscle_bayes.inference.search.descent import Fitted

NONE, UNKNOWN = "none", "unknown"
PRIOR_NONE = 0.5
"""Prior probability that nothing is missing; candidates share the rest equally."""
PRIOR_UNKNOWN = 0.05
"""Prior probability of something unknown, against everything known."""
RESAMPLES = 400
CLAIM = 0.9
"""Probability that something is missing from which on it is claimed."""
TIED = 0.1
"""Effects are told as a tie with the likeliest when at least this share as probable."""


def unexplained(p_value: float) -> float:
    """Largest odds with which a p-value speaks against a model: -1 / (e p ln p) for p < 1/e, else 1.

    Source: Sellke, Bayarri and Berger, The American Statistician 55 (2001), p. 62.
    """
    return -1.0 / (math.e * p_value * np.log(p_value)) if p_value < 1.0 / math.e else 1.0


def most_odds(p_value: float) -> float:
    """Largest odds of all candidates together against none that a misfit's p-value supports."""
    return unexplained(p_value) * (1.0 - PRIOR_NONE) / PRIOR_NONE


def could_claim(p_value: float) -> bool:
    """Whether a misfit of this p-value could have something claimed for it, whatever explains it."""
    odds = most_odds(p_value)
    return odds / (1.0 + odds) >= CLAIM


@dataclass(frozen=True)
class Naming:
    """What one comparison of candidates says."""

    probabilities: Mapping[str, float]
    """Of every candidate and of none; they sum to 1."""
    log_evidence: Mapping[str, float]
    """Of every candidate and of none."""
    bic: Mapping[str, float]
    """Bayesian information criterion, k ln n - 2 ln L, of every candidate and of none."""

    def supported(self, p_value: float) -> "Naming":
        """The same, something missing being at most as likely as the misfit's p-value allows.

        Evidence rests on the model being right to the last; a misfit that cannot be seen in any
        window is none that an effect should be claimed for. Odds of all candidates together against
        none stay below `most_odds(p_value)`.
        """
        none = self.probabilities[NONE]
        odds = (1.0 - none) / max(none, 1e-300)
        limit = most_odds(p_value)
        if odds <= limit:
            return self
        share = limit / (1.0 + limit) / (1.0 - none)
        found = {name: share * p for name, p in self.probabilities.items()}
        return replace(self, probabilities=found | {NONE: 1.0 / (1.0 + limit)})

    @property
    def best(self) -> str:
        """The likeliest candidate."""
        return max(
            (name for name in self.probabilities if name != NONE),
            key=lambda name: self.probabilities[name],
        )

    @property
    def claims(self) -> bool:
        """Whether something is missing."""
        return 1.0 - self.probabilities[NONE] >= CLAIM

    @property
    def tie(self) -> tuple[str, ...]:
        """Effects that the data cannot tell apart, likeliest first; empty if one stands alone."""
        named = {name: p for name, p in self.probabilities.items() if name != NONE}
        order = sorted(named, key=lambda name: -named[name])
        close = [name for name in order if named[name] >= TIED * named[order[0]]]
        return tuple(close) if len(close) > 1 and self.claims else ()

    def with_unknown(self, odds: float, odds_against_none: float = 1.0) -> dict[str, float]:
        """Probabilities with something unknown among them.

        `odds`: how much better it explains the readings than the final model of named effects, whose
        whole evidence counts for the effect that was added first. `odds_against_none`: how much better
        than the nominal model alone, where no effect was added; what the candidates have stays theirs.
        """
        better = max(odds, odds_against_none * self.probabilities[NONE])
        share = 1.0 / (1.0 + better * PRIOR_UNKNOWN / (1.0 - PRIOR_UNKNOWN))
        found = {key: share * p for key, p in self.probabilities.items()}
        return found | {UNKNOWN: 1.0 - share}


def _block_scores(fitted: Fitted, blocks: np.ndarray) -> Float[np.ndarray, " block"]:
    inside = blocks >= 0
    return np.bincount(blocks[inside], weights=fitted.log_densities[inside])


def weigh(
    none: Fitted, candidates: Mapping[str, Fitted], blocks: Float[np.ndarray, " error"], seed: int
) -> Naming:
    """Probabilities of candidates by evidence, with what chance the readings alone leave in it.

    Each candidate's log evidence is its log likelihood, block by block, plus what prior and volume
    of the posterior add (Laplace). The blocks are resampled with Dirichlet weights (Bayesian
    bootstrap) and the posterior probabilities averaged: a lead that rests on few blocks is worth
    less. Source: Yao et al., Bayesian Analysis 13 (2018), section 3.4 (pseudo-BMA+).
    """
    names = [NONE, *candidates]
    fits = [none, *candidates.values()]
    scores = np.stack([_block_scores(one, blocks) for one in fits])
    occam = np.array([one.occam for one in fits])
    share = (1.0 - PRIOR_NONE) / max(len(candidates), 1)
    prior = np.log([PRIOR_NONE] + [share] * len(candidates))
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet(np.ones(scores.shape[1]), RESAMPLES) * scores.shape[1]
    log_evidence = weights @ (scores - scores[0]).T + occam - occam[0] + prior
    weighed = np.exp(log_evidence - log_evidence.max(axis=1, keepdims=True))
    mean = (weighed / weighed.sum(axis=1, keepdims=True)).mean(axis=0)
    readings = int(np.sum(blocks >= 0))
    return Naming(
        probabilities=dict(zip(names, map(float, mean), strict=True)),
        log_evidence={name: one.log_evidence for name, one in zip(names, fits, strict=True)},
        bic={
            name: one.used * math.log(readings) - 2.0 * float(one.log_densities.sum())
            for name, one in zip(names, fits, strict=True)
        },
    )
