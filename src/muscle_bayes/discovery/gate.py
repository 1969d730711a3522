"""Whether an effect predicts readings better that the fit has not seen."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from muscle_bayes.discovery.blocks import blocks_of
from muscle_bayes.discovery.conditions import Trace
from muscle_bayes.discovery.explanation import Explanation
from muscle_bayes.discovery.holding import without_blocks
from muscle_bayes.inference.search.descent import Fitted, descend
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.nested_programs import explained_at

FOLDS = 4
STEPS = 10
"""Steps from the fit to all readings to that without a fold."""
WANTED = 2.0
"""Standard errors by which the score must rise."""


@dataclass(frozen=True)
class Gate:
    """Rise of the log predictive density of readings that were left out [nat], and its error."""

    gain: float
    se: float
    by: str
    """What was left out: `blocks` of every run in turn, or `runs` that were held out."""

    @property
    def score(self) -> float:
        """Gain in standard errors; 0 where nothing differs."""
        return self.gain / self.se if self.se > 0.0 else 0.0

    def weighed_with(self, other: "Gate") -> "Gate":
        """What both say together: the one that speaks against the effect, else the clearer one."""
        weaker, clearer = sorted((self, other), key=lambda one: one.score)
        return weaker if weaker.score < -WANTED else clearer

    @property
    def passed(self) -> bool:
        return self.score > WANTED


def _densities(nested: Nested, fitted: Fitted) -> Float[np.ndarray, " error"]:
    """Log density of each reading of `nested`'s data, at a point fitted to other data."""
    point = jnp.asarray(fitted.point)
    found = explained_at(point, fitted.choice, nested.layout, nested.data)
    return np.concatenate([np.asarray(fit.log_density).ravel() for fit in found.fits])


def _gate(difference: np.ndarray, blocks: np.ndarray, by: str) -> Gate:
    """Sum over blocks, with the standard error that their scatter gives."""
    inside = blocks >= 0
    sums = np.bincount(blocks[inside], weights=difference[inside])
    sums = sums[np.unique(blocks[inside])]
    spread = np.sqrt(sums.size * np.var(sums, ddof=1)) if sums.size > 1 else np.inf
    return Gate(float(sums.sum()), float(spread), by)


def gate_by_runs(before: Explanation, after: Explanation, lines: Sequence[Trace]) -> Gate:
    """By runs that were held out, of which `before` and `after` have seen only the start.

    The log predictive density of a run given the others is the log evidence of all less that of the
    others (Laplace): what is not known of the run's own start is integrated out. All runs move the fit,
    which counts with its own motion there as without them.
    """
    gain, difference = 0.0, np.zeros(before.fitted.errors.size)
    for one, sign in ((after, 1.0), (before, -1.0)):
        seen = _of_all_runs(one).fitted
        gain += sign * (seen.log_evidence - one.fitted.log_evidence)
        difference += sign * seen.log_densities
    held = [line for line in lines if line.run in before.search.held]
    blocks = blocks_of(held, np.abs(difference))
    return replace(_gate(difference, blocks, "runs"), gain=gain)


def _of_all_runs(one: Explanation) -> Explanation:
    """The same model fitted to held-out runs too."""
    search = replace(one.search, held=()).over(one.search.whole)
    fitted = descend(search.train, one.fitted.effects, one.fitted.point, 0)
    return Explanation(search, fitted).settled()


def gate_by_blocks(
    before: Explanation, after: Explanation, blocks: Float[np.ndarray, " error"]
) -> Gate:
    """By every run's blocks, a quarter of them left out in turn and predicted from the rest."""
    difference = np.zeros(blocks.size)
    for fold in range(FOLDS):
        hidden = [b for b in np.unique(blocks) if b >= 0 and b % FOLDS == fold]
        mine = np.isin(blocks, hidden)
        for one, sign in ((after, 1.0), (before, -1.0)):
            nested = one.search.train
            part = without_blocks(nested, blocks, hidden)
            trained = descend(part, one.fitted.effects, one.fitted.point, STEPS)
            difference[mine] += sign * _densities(nested, trained)[mine]
    return _gate(difference, blocks, "blocks")
