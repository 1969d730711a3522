"""What gains are tuned for: one number from the costs of many draws."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float

Values = Mapping[str, Float[np.ndarray, " draw"]]
"""Of every draw: `cost`, and the metrics of JUDGED."""
Weights = dict[str, Float[np.ndarray, " draw"]]
"""Derivative of a criterion with respect to them."""

JUDGED: Final = ("tracking_error", "overshoot", "energy", "peak_temperature")
"""Metrics of which a specification may be made: those that have derivatives."""


def cvar(costs: Float[np.ndarray, " draw"], level: float) -> float:
    """Conditional value at risk: the mean of the worst 1 - level of the costs."""
    return float(cvar_weights(costs, level) @ costs)


def cvar_weights(costs: Float[np.ndarray, " draw"], level: float) -> Float[np.ndarray, " draw"]:
    """Weights of the draws in the empirical CVaR, which are its derivative as well.

    min_t t + mean (c - t)_+ / (1 - level): Rockafellar and Uryasev, J. Risk 2 (2000), 21-41. The draw
    at the quantile counts with the share that is left.
    """
    tail = (1.0 - level) * costs.size
    order = np.argsort(-costs, kind="stable")
    weights = np.zeros(costs.size)
    weights[order] = np.clip(tail - np.arange(costs.size), 0.0, 1.0)
    return weights / tail


@dataclass(frozen=True)
class Criterion:
    """A number to be made small."""

    @abstractmethod
    def __call__(self, values: Values) -> tuple[float, Weights]:
        """Its value, and its derivative with respect to what it looks at."""

    @property
    @abstractmethod
    def name(self) -> str:
        """As shown."""


@dataclass(frozen=True)
class MeanCost(Criterion):
    """The mean cost."""

    def __call__(self, values: Values) -> tuple[float, Weights]:
        cost = values["cost"]
        return float(cost.mean()), {"cost": np.full(cost.size, 1.0 / cost.size)}

    @property
    def name(self) -> str:
        return "mean cost"


@dataclass(frozen=True)
class CVaR(Criterion):
    """Conditional value at risk of the cost."""

    level: float = 0.95

    def __call__(self, values: Values) -> tuple[float, Weights]:
        weights = cvar_weights(values["cost"], self.level)
        return float(weights @ values["cost"]), {"cost": weights}

    @property
    def name(self) -> str:
        return f"{self.level:.0%} CVaR of the cost"


@dataclass(frozen=True)
class Shortfall(Criterion):
    """1 - probability of meeting a specification, every metric at most its limit.

    Steps of the probability are smoothed, each limit to a logistic function as wide as `softness` of
    it: so that gradients know the way.
    """

    limits: tuple[tuple[str, float], ...]
    softness: float = 0.05

    def __call__(self, values: Values) -> tuple[float, Weights]:
        shares = {}
        for name, limit in self.limits:
            # A metric that a scenario does not have meets every limit.
            distance = np.nan_to_num((limit - values[name]) / (self.softness * limit), nan=50.0)
            shares[name] = 1.0 / (1.0 + np.exp(-np.clip(distance, -50.0, 50.0)))
        met = np.prod(list(shares.values()), axis=0)
        weights = {
            name: met * (1.0 - shares[name]) / (self.softness * limit) / met.size
            for name, limit in self.limits
        }
        return float(1.0 - met.mean()), weights

    @property
    def name(self) -> str:
        return "probability of missing " + ", ".join(f"{n} <= {v:g}" for n, v in self.limits)
