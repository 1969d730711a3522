"""Which effect is missing: a probability for each, for none, and for something unknown."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from muscle_bayes.discovery.conditions import Trace
from muscle_bayes.inference.descent import Fitted

NONE, UNKNOWN = "none", "unknown"
PRIOR_NONE, PRIOR_UNKNOWN = 0.5, 0.1
"""Prior probabilities; the rest is shared equally by the candidates."""
BLOCKS = 20
"""Blocks of a run that count as independent of each other."""
RESAMPLES = 400
CLAIM = 0.95
"""Probability that something is missing from which on it is claimed."""
TIED = 0.1
"""Effects are told as a tie with the likeliest when at least this share as probable."""


def unexplained(p_value: float) -> float:
    """Largest odds with which a p-value speaks against a model: -1 / (e p ln p) for p < 1/e, else 1.

    Source: Sellke, Bayarri and Berger, The American Statistician 55 (2001), p. 62.
    """
    return -1.0 / (np.e * p_value * np.log(p_value)) if p_value < 1.0 / np.e else 1.0


@dataclass(frozen=True)
class Naming:
    """What one comparison of candidates says."""

    probabilities: Mapping[str, float]
    """Of every candidate, of none and of unknown; they sum to 1."""
    log_odds: Mapping[str, float]
    """Log evidence of each candidate above that of none."""

    @property
    def best(self) -> str:
        """The likeliest."""
        return max(self.probabilities, key=lambda name: self.probabilities[name])

    @property
    def claims(self) -> bool:
        """Whether something is missing."""
        return 1.0 - self.probabilities[NONE] >= CLAIM

    @property
    def tie(self) -> tuple[str, ...]:
        """Effects that the data cannot tell apart, likeliest first; empty if one stands alone."""
        named = {k: p for k, p in self.probabilities.items() if k not in (NONE, UNKNOWN)}
        order = sorted(named, key=lambda name: -named[name])
        close = [name for name in order if named[name] >= TIED * named[order[0]]] if order else []
        return tuple(close) if len(close) > 1 and self.claims else ()


def blocks_of(lines: Sequence[Trace], size: int) -> Float[np.ndarray, " error"]:
    """Number of the block in which each standardised error lies; -1 where nothing is observed."""
    found = np.full(size, -1)
    for number, line in enumerate(lines):
        edges = np.linspace(line.time[0], line.time[-1], BLOCKS + 1)
        inside = np.clip(np.searchsorted(edges, line.time, side="right") - 1, 0, BLOCKS - 1)
        found[line.place] = number * BLOCKS + inside
    return found


def _block_scores(fitted: Fitted, blocks: np.ndarray) -> Float[np.ndarray, " block"]:
    inside = blocks >= 0
    return np.bincount(blocks[inside], weights=fitted.log_densities[inside])


def weigh(
    none: Fitted,
    candidates: Mapping[str, Fitted],
    blocks: Float[np.ndarray, " error"],
    unknown_odds: float,
    seed: int,
) -> Naming:
    """Probabilities of candidates by evidence, with what chance the readings alone leave in it.

    Each candidate's log evidence is its log likelihood, block by block, plus what prior and volume
    of the posterior add (Laplace). The blocks are resampled with Dirichlet weights (Bayesian
    bootstrap) and the posterior probabilities averaged: a lead that rests on few blocks is worth
    less. Source: Yao et al., Bayesian Analysis 13 (2018), section 3.4 (pseudo-BMA+). `unknown_odds`:
    of something unknown against the likeliest that is known.
    """
    names = [NONE, *candidates]
    fits = [none, *candidates.values()]
    scores = np.stack([_block_scores(one, blocks) for one in fits])
    occam = np.array([one.occam for one in fits])
    share = (1.0 - PRIOR_NONE - PRIOR_UNKNOWN) / max(len(candidates), 1)
    prior = np.log([PRIOR_NONE] + [share] * len(candidates))
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet(np.ones(scores.shape[1]), RESAMPLES) * scores.shape[1]
    log_evidence = weights @ (scores - scores[0]).T + occam - occam[0] + prior
    unknown = log_evidence.max(axis=1) + np.log(PRIOR_UNKNOWN * unknown_odds)
    columns = np.column_stack([log_evidence, unknown])
    columns = np.exp(columns - columns.max(axis=1, keepdims=True))
    mean = (columns / columns.sum(axis=1, keepdims=True)).mean(axis=0)
    odds = {name: one.log_evidence - none.log_evidence for name, one in candidates.items()}
    probabilities = dict(zip([*names, UNKNOWN], map(float, mean), strict=True))
    return Naming(probabilities, odds)
