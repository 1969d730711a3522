"""Slope and shift of a stretch of readings, measured and predicted."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

END_SHARE = 0.15
"""Share of a phase's readings averaged at either end for the shift; at least two."""

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """A number with the 5 and 95 % quantiles of what it may be."""

    mean: float
    q05: float
    q95: float

    @classmethod
    def of(cls, draws: Values) -> "Estimate":
        low, high = np.quantile(draws, [0.05, 0.95])
        return cls(float(draws.mean()), float(low), float(high))


@dataclass(frozen=True)
class Creep:
    """One measure of a phase's creep, measured and predicted."""

    measured: float
    standard_error: float
    predicted: Estimate
    """what the model gives: uncertainty of the parameters only"""
    difference: Estimate
    """measured - predicted, uncertainty of both"""


def inflation(residual: Values) -> float:
    """Factor by which autocorrelation of lag one, r, widens errors: sqrt((1 + r)/(1 - r)) >= 1."""
    power = float(residual @ residual)
    if power == 0.0:
        return 1.0
    r = min(max(float(residual[1:] @ residual[:-1]) / power, 0.0), 0.9)
    return float(np.sqrt((1.0 + r) / (1.0 - r)))


def slope_weights(time: Values) -> Values:
    """w with w . y the least-squares slope of y over time, per minute."""
    centred = (time - time.mean()) / 60.0
    return centred / float(centred @ centred)


def shift_weights(time: Values) -> Values:
    """w with w . y the mean of the last readings minus the mean of the first."""
    ends = max(2, round(END_SHARE * time.size))
    weights = np.zeros(time.size)
    weights[:ends], weights[-ends:] = -1.0 / ends, 1.0 / ends
    return weights


def creep(weights: Values, observed: Values, model: Values, noise: float, wobble: Values):
    """One linear measure of the readings; `noise` is the effective error of a single reading.

    Also returns the draws of its difference, which phases share and must be averaged draw by draw.
    """
    measured = float(weights @ observed)
    error = noise * float(np.linalg.norm(weights))
    predicted = model @ weights
    difference = measured - predicted + error * wobble
    return Creep(measured, error, Estimate.of(predicted), Estimate.of(difference)), difference
