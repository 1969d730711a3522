"""Weigh: a probability for each effect, for none, and for something unknown."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from muscle_bayes.discovery.conditions import Trace
from muscle_bayes.discovery.fitted import Fitted

NONE, UNKNOWN = "none", "unknown"
PRIOR_NONE = 0.5
"""Prior probability that nothing is missing; candidates share the rest equally."""
PRIOR_UNKNOWN = 0.05
"""Prior probability of something unknown, against everything known."""
CLAIM = 0.9
"""Probability that something is missing from which on it is claimed."""


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
    def order(self) -> list[str]:
        """All names, likeliest first."""
        return sorted(self.probabilities, key=lambda name: -self.probabilities[name])

    def with_far(self, far: Mapping[str, float], near: Mapping[str, float]) -> "Naming":
        """The same with candidates too far behind to be weighed, whose log evidence stands beside the
        near ones' of the same search."""
        top = max(near, key=lambda name: near[name], default=None)
        share = 0.0 if top is None else self.probabilities[top]
        lag = {name: np.exp(min(e - near[top], 0.0)) if top else 0.0 for name, e in far.items()}
        return self.corrected({}, {name: share * float(x) for name, x in lag.items()})

    def corrected(
        self, log_factors: Mapping[str, float], more: Mapping[str, float] | None = None
    ) -> "Naming":
        """Probabilities times exp(log factor), with `more` of them; they sum to 1 again."""
        raised = {
            name: p * float(np.exp(np.clip(log_factors.get(name, 0.0), -50.0, 50.0)))
            for name, p in self.probabilities.items()
        } | dict(more or {})
        total = sum(raised.values())
        return replace(self, probabilities={name: p / total for name, p in raised.items()})

    @property
    def best(self) -> str:
        """The likeliest candidate."""
        return next(name for name in self.order if name != NONE)

    @property
    def claims(self) -> bool:
        """Whether something is missing."""
        return 1.0 - self.probabilities[NONE] >= CLAIM

    @property
    def tie(self) -> tuple[str, ...]:
        """Effects that the data cannot separate, down to a tenth as likely as the likeliest, in order."""
        order = [name for name in self.order if name != NONE]
        close = [n for n in order if self.probabilities[n] >= 0.1 * self.probabilities[order[0]]]
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
    none: Fitted,
    candidates: Mapping[str, Fitted],
    blocks: Int[np.ndarray, " error"],
    seed: int,
    resamples: int = 400,
    among: int | None = None,
) -> Naming:
    """Probabilities of candidates by evidence, with what chance the readings alone leave in it.

    Each candidate's log evidence is its log likelihood, block by block, plus what prior and volume
    of the posterior add (Laplace). The blocks are resampled with Dirichlet weights (Bayesian
    bootstrap) and the posterior probabilities averaged: a lead that rests on few blocks is worth
    less. The prior that none leaves is shared by all candidates that were searched, `among` them these.
    Source: Yao et al., Bayesian Analysis 13 (2018), section 3.4 (pseudo-BMA+).
    """
    names = [NONE, *candidates]
    fits = [none, *candidates.values()]
    scores = np.stack([_block_scores(one, blocks) for one in fits])
    occam = np.array([one.occam for one in fits])
    share = (1.0 - PRIOR_NONE) / max(among or len(candidates), 1)
    prior = np.log([PRIOR_NONE] + [share] * len(candidates))
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet(np.ones(scores.shape[1]), resamples) * scores.shape[1]
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


def linear(log_bayes_factors: Mapping[str, float]) -> Naming:
    """Probabilities from evidence in the linearised model, where no candidate was fitted."""
    share = (1.0 - PRIOR_NONE) / max(len(log_bayes_factors), 1)
    prior = {NONE: PRIOR_NONE, **dict.fromkeys(log_bayes_factors, share)}
    return Naming(prior, {NONE: 0.0, **log_bayes_factors}, {}).corrected(log_bayes_factors)


def in_dispute(one: Fitted, other: Fitted) -> Float[np.ndarray, " error"]:
    """How far two models differ in the log density of each reading [nat]."""
    return np.abs(one.log_densities - other.log_densities)


def blocks_of(
    lines: Sequence[Trace], disputed: Float[np.ndarray, " error"], parts: int = 20
) -> Int[np.ndarray, " error"]:
    """Number of the block in which each reading lies, in order of time; -1 where nothing is observed.

    Every run is split into `parts` of equal time, and those that hold more than their share of what two
    models dispute are halved: in blocks of equal time an effect that acts for some seconds would stand or
    fall with one of them. What is disputed are densities of readings given those before, so neighbours
    count as independent. But for those of a segment, which are known together only, its start being
    integrated out: no block holds a part of one.
    """
    found = np.full(disputed.size, -1)
    most = sum(float(disputed[line.place].sum()) for line in lines) / parts
    number = 0
    for line in lines:
        edges = np.linspace(line.time[0], line.time[-1], parts + 1)
        begins = np.flatnonzero(np.diff(line.segment, prepend=-1) != 0)
        cuts = np.append(begins, line.time.size)[
            np.searchsorted(begins, np.searchsorted(line.time, edges[1:-1]))
        ]
        for part in np.split(np.arange(line.time.size), cuts):
            for block in _halved(part, disputed[line.place], line.segment, most):
                found[line.place[block]] = number
                number += 1
    return found


def _halved(
    block: Int[np.ndarray, " reading"],
    disputed: Float[np.ndarray, " interval"],
    segment: Int[np.ndarray, " interval"],
    most: float,
) -> list[Int[np.ndarray, " reading"]]:
    cuts = 1 + np.flatnonzero(np.diff(segment[block]))
    if not cuts.size or disputed[block].sum() <= most:
        return [block]
    middle = cuts[np.argmin(np.abs(cuts - block.size // 2))]
    return [
        half
        for part in (block[:middle], block[middle:])
        for half in _halved(part, disputed, segment, most)
    ]
