"""Gains that make a criterion small over the draws: global start, then gradients."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any, Final

import numpy as np
from scipy.optimize import minimize
from scipy.stats import qmc

from muscle_bayes.control.batch import Bank
from muscle_bayes.control.cost import Cost
from muscle_bayes.control.criteria import Criterion
from muscle_bayes.control.gains import Gains
from muscle_bayes.control.laws.build import Numbers
from muscle_bayes.control.scenario import Scenario
from muscle_bayes.control.sensitivity import judged_values
from muscle_bayes.inference.running.precision import double_precision

Report = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Box:
    """Where gains are looked for: the lowest and highest of each of `Numbers`.

    Proportional and integral gains are searched on a logarithmic scale, the bias on a linear one.
    """

    proportional: tuple[float, float] = (200.0, 20000.0)
    """duty / rad; the upper end is about what the firmware's integers hold"""
    integral: tuple[float, float] = (2.0, 2500.0)
    """duty / (rad s)"""
    bias: tuple[float, float] = (0.0, 60.0)
    """duty"""

    def numbers(self, place: np.ndarray) -> tuple[Numbers, np.ndarray]:
        """Numbers at a place in the unit cube, and their derivatives along it."""
        values, slopes = [], []
        for x, (low, high) in zip(place[:2], (self.proportional, self.integral), strict=True):
            span = np.log(high / low)
            values.append(low * np.exp(span * x))
            slopes.append(values[-1] * span)
        low, high = self.bias
        values.append(low + (high - low) * place[2])
        slopes.append(high - low)
        return Numbers(*values), np.array(slopes)


CASCADE_BOX: Final = Box(proportional=(20.0, 5000.0), integral=(0.2, 500.0), bias=(0.0, 25.0))
"""K / rad, K / (rad s), K."""


@dataclass(frozen=True)
class Effort:
    """How hard to look."""

    starts: int = 32
    """Sobol points of the global search, a power of two."""
    scout_draws: int = 16
    """Draws on which these are tried."""
    refined: int = 2
    """Best of them that gradients go on from."""
    steps: int = 12
    """Most iterations of L-BFGS-B from each."""


@dataclass
class Tuning:
    """Gains found, and how."""

    gains: Gains
    value: float
    """of the criterion on the draws tuned on"""
    criterion: str
    evaluations: int
    history: list[float] = field(default_factory=list, repr=False)

    def _repr_html_(self) -> str:
        told = f"{self.criterion} {self.value:.4g}, {self.evaluations} evaluations"
        return f"<p><b>Tuning</b>: {escape(told)}</p>{self.gains._repr_html_()}"


class _Objective:
    """Mean over the scenarios of the criterion, at a place in the unit cube; keeps the best seen."""

    def __init__(self, gains, scenarios, criterion, cost, box) -> None:
        self._gains, self._scenarios, self._criterion = gains, scenarios, criterion
        self._cost, self._box = cost, box
        self.best: tuple[float, np.ndarray] = (np.inf, np.full(3, 0.5))
        self.history: list[float] = []

    def value(self, bank: Bank, place: np.ndarray) -> float:
        numbers, _ = self._box.numbers(place)
        found = [
            self._criterion(
                judged_values(bank, self._gains, numbers, s, self._cost, derivatives=False)[0]
            )[0]
            for s in self._scenarios
        ]
        return float(np.nan_to_num(np.mean(found), nan=1e6))

    def with_gradient(self, bank: Bank, place: np.ndarray) -> tuple[float, np.ndarray]:
        numbers, along = self._box.numbers(place)
        total, gradient = 0.0, np.zeros(3)
        for scenario in self._scenarios:
            values, slopes = judged_values(bank, self._gains, numbers, scenario, self._cost)
            assert slopes is not None
            value, weights = self._criterion(values)
            total += value / len(self._scenarios)
            for name, weight in weights.items():
                # Where a weight is zero the metric may have no derivative.
                used = weight != 0.0
                gradient += weight[used] @ slopes[name][used] / len(self._scenarios)
        total = float(np.nan_to_num(total, nan=1e6))
        self.history.append(total)
        if total < self.best[0]:
            self.best = (total, place.copy())
        return total, np.nan_to_num(gradient * along)


@double_precision
def tune(
    bank: Bank,
    scenarios: Sequence[Scenario],
    criterion: Criterion,
    gains: Gains,
    *,
    cost: Cost | None = None,
    box: Box | None = None,
    effort: Effort | None = None,
    seed: int = 0,
    report: Report = lambda stage, done, total: None,
) -> Tuning:
    """Gains of the law of `gains` that make the criterion's mean over the scenarios small.

    Scrambled Sobol points are tried on a few draws; from the best of them L-BFGS-B goes on with all
    draws, by derivatives through the simulation. What is returned is the best point seen.
    """
    box = box or (CASCADE_BOX if gains.law == "cascade" else Box())
    effort = effort or Effort()
    objective = _Objective(gains, scenarios, criterion, cost or Cost(), box)
    scouts = Bank(bank.draws.take(slice(0, effort.scout_draws)), bank.clock, bank.seed)
    places = qmc.Sobol(3, rng=np.random.default_rng(seed)).random(effort.starts)
    tried = []
    for number, place in enumerate(places):
        tried.append(objective.value(scouts, place))
        report("searching", number + 1, effort.starts)

    def sloped(place: np.ndarray) -> Any:
        return objective.with_gradient(bank, place)

    for number, index in enumerate(np.argsort(tried)[: effort.refined]):
        minimize(
            sloped,
            places[index],
            jac=True,
            method="L-BFGS-B",
            bounds=[(0.0, 1.0)] * 3,
            options={"maxiter": effort.steps, "maxfun": 2 * effort.steps},
        )
        report("refining", number + 1, effort.refined)
    value, place = objective.best
    numbers, _ = box.numbers(place)
    found = gains.model_copy(update={k: float(v) for k, v in numbers._asdict().items()})
    evaluations = effort.starts + len(objective.history)
    return Tuning(found, value, criterion.name, evaluations, objective.history)
