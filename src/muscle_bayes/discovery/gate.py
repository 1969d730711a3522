"""Gate: whether an effect predicts readings better that the fit has not seen (cross-validation)."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from muscle_bayes.discovery.conditions import Trace
from muscle_bayes.discovery.fit import Search
from muscle_bayes.discovery.fitted import Fitted, Start
from muscle_bayes.discovery.nominal import error_of_reading
from muscle_bayes.discovery.weigh import blocks_of, in_dispute
from muscle_bayes.inference.model.problem import Data


@dataclass(frozen=True)
class Gate:
    """Rise of the log predictive density of readings that were left out [nat], and its error."""

    gain: float
    se: float
    by: str
    """What was left out: `blocks` of every run in turn, or `runs` that were held out."""
    wanted: float = 2.0
    """Standard errors by which the score must rise."""

    @property
    def score(self) -> float:
        """Gain in standard errors; 0 where nothing differs."""
        return self.gain / self.se if self.se > 0.0 else 0.0

    def weighed_with(self, other: "Gate") -> "Gate":
        """What both say together: the one that speaks against the effect, else the clearer one."""
        weaker, clearer = sorted((self, other), key=lambda one: one.score)
        return weaker if weaker.score < -self.wanted else clearer

    @property
    def passed(self) -> bool:
        """Whether it rose clearly."""
        return self.score > self.wanted


class Unseen:
    """Models, each fitted without a quarter of all blocks in turn, judged by the readings left out."""

    def __init__(
        self,
        search: Search,
        models: Mapping[str, Fitted],
        blocks: Int[np.ndarray, " error"],
        *,
        folds: int = 4,
        steps: int = 10,
    ) -> None:
        self.blocks = blocks
        hidden = [
            [b for b in np.unique(blocks) if b >= 0 and b % folds == fold] for fold in range(folds)
        ]
        rows = [
            one.start._replace(data=without_blocks(one.data, blocks, some))
            for one in models.values()
            for some in hidden
        ]
        trained = search.fit(rows, steps=steps)
        whole = [
            Start(fit.effects, fit.point, one.data)
            for fit, one in zip(trained, [m for m in models.values() for _ in hidden], strict=True)
        ]
        seen, scale = search.explained(whole), error_of_reading(search)
        self.log_density: dict[str, Float[np.ndarray, " error"]] = {}
        self.squares: dict[str, Float[np.ndarray, " error"]] = {}
        for index, name in enumerate(models):
            density, squares = np.zeros(blocks.size), np.zeros(blocks.size)
            for fold, some in enumerate(hidden):
                mine = np.isin(blocks, some)
                found = seen[index * folds + fold]
                density[mine] = np.nan_to_num(found.log_densities, nan=-1e3)[mine]
                away = np.concatenate([np.asarray(one).ravel() for one in found.residuals])
                squares[mine] = np.nan_to_num((away[mine] / scale[mine]) ** 2, nan=1e12)
            self.log_density[name], self.squares[name] = density, squares

    def gate(self, before: str, after: str) -> Gate:
        """By what the readings left out say of two models."""
        return gate_of(self.log_density[after] - self.log_density[before], self.blocks, "blocks")

    def closed(self, before: str, after: str) -> float:
        """Share of the squared misfit above the noise that `after` takes away, on readings left out."""
        inside = self.blocks >= 0
        gap = float(np.sum(self.squares[before][inside] - 1.0))
        won = float(np.sum(self.squares[before][inside] - self.squares[after][inside]))
        return won / gap if gap > 0.0 else 0.0


def without_blocks(data: Data, blocks: Int[np.ndarray, " error"], chosen: Collection[int]) -> Data:
    """The data without these blocks of readings."""
    lanes, start = [], 0
    for group in data.lanes:
        own = blocks[start : start + group.weight.size].reshape(group.weight.shape)
        start += group.weight.size
        hidden = jnp.asarray(np.isin(own, list(chosen)))
        lanes.append(group._replace(weight=jnp.where(hidden, 0.0, group.weight)))
    return data._replace(lanes=tuple(lanes))


def gate_of(
    difference: Float[np.ndarray, " error"], blocks: Int[np.ndarray, " error"], by: str
) -> Gate:
    """Sum over blocks, with the standard error that their scatter gives."""
    inside = blocks >= 0
    sums = np.bincount(blocks[inside], weights=difference[inside])
    sums = sums[np.unique(blocks[inside])]
    spread = np.sqrt(sums.size * np.var(sums, ddof=1)) if sums.size > 1 else np.inf
    return Gate(float(sums.sum()), float(spread), by)


def gate_by_runs(search: Search, before: Fitted, after: Fitted, lines: Sequence[Trace]) -> Gate:
    """By runs that were held out, of which `before` and `after` have seen only the start.

    The log predictive density of a run given the others is the log evidence of all less that of the
    others (Laplace): what is not known of the run's own start is integrated out.
    """
    less, more = search.fit([search.whole(before), search.whole(after)])
    gain = (more.log_evidence - after.log_evidence) - (less.log_evidence - before.log_evidence)
    difference = more.log_densities - less.log_densities
    blocks = blocks_of([one for one in lines if one.run in search.held], in_dispute(more, less))
    found = gate_of(difference, blocks, "runs")
    return Gate(float(gain), found.se, "runs")
