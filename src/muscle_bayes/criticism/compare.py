"""Which of two posteriors of the same runs predicts their readings better."""

from dataclasses import asdict, dataclass
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from muscle_bayes.errors import MuscleBayesError, refuse_all_but
from muscle_bayes.inference.posteriors.posterior import Posterior

SHORTEST_BLOCK = 1.0
"""Shortest block whose sum counts as independent of the next, s."""
FEWEST_BLOCKS = 4
"""A run is cut into at least this many blocks."""

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Score:
    """Difference of expected log predictive density, first minus second posterior."""

    elpd_difference: float
    """nat, summed over readings"""
    se: float
    """its standard error"""
    readings: int


@dataclass(frozen=True, repr=False)
class Comparison:
    """`better` is the name of the better posterior, or `neither` within two standard errors."""

    better: str
    names: tuple[str, str]
    elpd_difference: float
    """first minus second, nat"""
    se: float
    per_run: dict[str, Score]

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers."""
        return asdict(self)

    def __repr__(self) -> str:
        first, second = self.names
        return (
            f"Comparison({first} - {second}: elpd {self.elpd_difference:+.1f} "
            f"± {self.se:.1f}; better: {self.better})"
        )

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(run)}<td>{s.elpd_difference:+.1f}<td>{s.se:.1f}<td>{s.readings}</tr>"
            for run, s in self.per_run.items()
        )
        header = "<th>run<th>elpd difference<th>standard error<th>readings"
        return f"<p>{escape(repr(self))}</p><table><tr>{header}</tr>{rows}</table>"


def pointwise_elpd(log_likelihood: Values) -> Values:
    """WAIC's estimate for each reading: log mean exp l - var l over the draws, l (draw, reading).

    Readings are conditioned on the earlier ones, so this scores one-step predictions.
    """
    draws = log_likelihood.shape[0]
    density = logsumexp(log_likelihood, axis=0) - np.log(draws)
    return density - log_likelihood.var(axis=0, ddof=1)


def correlation_length(values: Values) -> float:
    """Integrated autocorrelation 1 + 2 sum r_k up to the first r_k <= 0, in readings."""
    centred = values - values.mean()
    power = float(centred @ centred)
    total = 1.0
    for lag in range(1, values.size // 3 if power > 0.0 else 0):
        r = float(centred[lag:] @ centred[:-lag]) / power
        if r <= 0.0:
            break
        total += 2.0 * r
    return total


def _score(difference: Values, time: Values) -> Score:
    """Sum over a run, with a standard error from the spread of the sums over blocks."""
    duration = float(time[-1] - time[0])
    spacing = duration / max(time.size - 1, 1)
    block = max(SHORTEST_BLOCK, 2.0 * correlation_length(difference) * spacing)
    blocks = max(FEWEST_BLOCKS, int(duration / block))
    # Blocks of equal numbers of readings: dropped intervals make blocks of equal time unequal.
    blocks = min(blocks, difference.size)
    sums = np.array([part.sum() for part in np.array_split(difference, blocks)])
    se = float(np.sqrt(blocks * sums.var(ddof=1))) if blocks > 1 else float("nan")
    return Score(float(difference.sum()), se, difference.size)


def _pointwise(posterior: Posterior) -> dict[str, Values]:
    group = posterior.tree["log_likelihood"].to_dataset()
    return {
        str(name): pointwise_elpd(values.to_numpy().reshape(-1, values.shape[-1]))
        for name, values in group.data_vars.items()
    }


def compare(
    first: Posterior, second: Posterior, names: tuple[str, str] | None = None
) -> Comparison:
    """Which of two posteriors of the same runs predicts their readings better.

    Args:
        first: a posterior.
        second: a posterior of the same runs under another model.
        names: of the two; default: their friction laws.

    Returns:
        The difference of expected log predictive density [nat], first minus second, with its
        standard error, and which is better; "neither" within two standard errors.

    Raises:
        MuscleBayesError: where the two were fitted to different readings.

    Example:
        >>> import muscle_bayes as mb
        >>> runs = mb.load_example("springs")
        >>> dry = mb.fit(runs, effort="quick", progress=False)
        >>> viscous = mb.fit(runs, "linear", effort="quick", progress=False)
        >>> mb.compare(dry, viscous).better
        'coulomb'
    """
    for one, key in ((first, "first"), (second, "second")):
        refuse_all_but(Posterior, one, key, "give one that `fit` or `load` returns")
    names = names or (first.friction, second.friction)
    ours, theirs = _pointwise(first), _pointwise(second)
    if set(ours) != set(theirs) or any(ours[run].size != theirs[run].size for run in ours):
        raise MuscleBayesError(
            "the two posteriors were fitted to different readings and cannot be compared. "
            "Fix: fit both to the same runs."
        )
    times = first.tree["constant_data"].to_dataset()
    scores = {run: _score(ours[run] - theirs[run], times[f"{run}:time"].to_numpy()) for run in ours}
    total = sum(score.elpd_difference for score in scores.values())
    se = float(np.sqrt(sum(score.se**2 for score in scores.values())))
    better = "neither" if abs(total) < 2.0 * se or total == 0.0 else names[0 if total > 0.0 else 1]
    return Comparison(better, names, total, se, scores)
