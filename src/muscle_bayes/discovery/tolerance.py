"""The noise of a reading, and how much lasting misfit counts as none."""

import numpy as np

from muscle_bayes.data.run import Run
from muscle_bayes.inference.model.problem import Problem

TOLERATED = {"slow": 0.15, "fast": 0.3}
"""Lasting misfit that counts as none, in standard deviations of a reading's noise: temperatures between
readings are guessed, and rounding biases the readings of a rotor at rest."""


def noise_of_reading(run: Run) -> float:
    """White noise of one reading besides rounding [the log's unit], from third differences.

    A reading's third difference has 20 times its variance; the largest hundredth is left out, for
    there the rotor jumps. What rounding adds, a twelfth of the squared resolution, is taken off.
    """
    third = np.abs(np.diff(run.table["reading"].to_numpy(), 3))
    kept = third[third <= np.quantile(third, 0.99)] if third.size else np.zeros(1)
    variance = np.mean(kept**2) / 20.0
    rounding = run.sensor.resolution**2 / 12.0
    return float(np.sqrt(max(variance - rounding, 0.04 * rounding, 1e-24)))


def noise_by_regime(problem: Problem) -> dict[str, float]:
    """Median noise of a reading over the runs of each regime [the log's unit]."""
    levels: dict[str, dict[int, float]] = {}
    for regime, owners in zip(problem.layout.regimes, problem.lane_runs, strict=True):
        for owner in owners:
            levels.setdefault(regime, {})[owner] = noise_of_reading(problem.runs[owner])
    return {regime: float(np.median(list(found.values()))) for regime, found in levels.items()}


def tolerated(problem: Problem) -> dict[str, float]:
    """Size of the discrepancy that is always allowed, of each regime [the log's unit]."""
    return {regime: TOLERATED[regime] * level for regime, level in noise_by_regime(problem).items()}
