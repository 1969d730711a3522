"""What a loop must do, as engineers write it: limits on settling, overshoot, error, heat, tracking."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from jaxtyping import Bool, Float

from muscle_bayes.control.judging.metrics import RUNAWAY, Metrics
from muscle_bayes.control.scenarios.scenario import Course, Scenario

STEP_WANTED: Final = {
    "settling_time": 30.0,
    "overshoot": np.radians(1.0),
    "steady_error": np.radians(0.34),
    "recovery_time": 30.0,
}
"""Of scenarios whose setpoint and load jump [s, rad]; a count of the bench is 0.33 degrees."""
TRACKING_WANTED: Final = {"tracking": float(np.sqrt(0.5))}
"""Of a setpoint that moves all the time: RMS error over RMS setpoint is 1 / sqrt(2) at the bandwidth
(Skogestad and Postlethwaite, Multivariable Feedback Control, section 2.4.5)."""
STEADY_WANTED: Final = {"tracking": 0.3}
"""Of a load that moves all the time while the setpoint stands."""
HOTTEST: Final = 100.0
"""Largest temperature wanted anywhere [C]."""
HARMLESS: Final = {"tracking": RUNAWAY, "peak_temperature": HOTTEST}
"""What is asked where more is out of reach: not to run away, and not to get hot."""
SLACK: Final = 1.5
"""What is asked is at most so many times stricter than what the best input could do."""
HOPELESS: Final = float(np.sqrt(0.5))
"""Tracking error of the best input from which a scenario is infeasible: beyond any bandwidth."""
MOST_JOINTS: Final = 0.9
"""Share of the joints on which the best input reaches what is taken for feasible."""
WORST: Final = 3.0
"""Excess at which misses are cut off, so that infinite times have a mean."""
DEGREES: Final = 10.0
"""Degrees above HOTTEST that count as an excess of 1 [K]."""


@dataclass(frozen=True)
class Specification:
    """Limits that a scenario's response has to keep.

    `feasible` holds what the best input reaches on MOST_JOINTS, and `attainable` is the share of joints on
    which it keeps all limits; both where that was computed. `infeasible` says why what was wanted is out
    of reach, and is empty where it is not; then the limits are HARMLESS.
    """

    limits: Mapping[str, float]
    feasible: Mapping[str, float] = field(default_factory=dict)
    infeasible: str = ""
    attainable: float = 1.0

    def excess(self, found: Metrics) -> dict[str, Float[np.ndarray, " draw"]]:
        """Of every limit, by how much it is missed, relative to it; at most 0 where it is met."""
        rows = {}
        for name, limit in self.limits.items():
            value = np.asarray(getattr(found, name), float)
            over = (value - limit) / DEGREES if name == "peak_temperature" else value / limit - 1.0
            # Not a number where the response has nothing of the kind, or is lost.
            over = np.where(np.isnan(over), np.where(found.runaway > 0, WORST, -1.0), over)
            rows[name] = np.clip(over, -1.0, WORST)
        return rows

    def worst(self, found: Metrics) -> Float[np.ndarray, " draw"]:
        """The largest excess of every draw."""
        return np.max(list(self.excess(found).values()), axis=0)

    def met(self, found: Metrics) -> Bool[np.ndarray, " draw"]:
        """Whether each draw keeps every limit."""
        return self.worst(found) <= 0.0

    def met_by_best(self, best: Metrics) -> Bool[np.ndarray, " draw"]:
        """Whether the best input (`feasible`) keeps every limit on each draw."""
        return self.worst_of_best(best) <= 0.0

    def worst_of_best(self, best: Metrics) -> Float[np.ndarray, " draw"]:
        """The largest excess of every draw under the best input.

        It keeps the temperature softly: a kelvin too much is the optimisation's own inexactness.
        """
        cooler = np.asarray(best.peak_temperature) - 1.0
        return self.worst(best._replace(peak_temperature=cooler))


def wanted(course: Course, chosen: Mapping[str, float] | None = None) -> Specification:
    """What is wanted of a course before anything is known of what can be done.

    Metrics that `chosen` names have its limits instead, where the course has them.
    """
    moving = TRACKING_WANTED if not _stands_still(course.setpoint) else STEADY_WANTED
    jumping = moving is STEADY_WANTED and _stands_still(course.load)
    limits = dict(STEP_WANTED if jumping else moving) | {"peak_temperature": HOTTEST}
    if not np.any(course.loaded):
        limits.pop("recovery_time", None)
    limits |= {key: value for key, value in (chosen or {}).items() if key in limits}
    return Specification(limits)


def _stands_still(values: np.ndarray) -> bool:
    """Whether a value changes by jumps only: less than a hundredth of the time."""
    return bool(np.mean(np.diff(values) != 0.0) < 0.01)


def within_reach(asked: Specification, best: Metrics) -> Specification:
    """The specification with limits no stricter than SLACK times what the best input reaches on most.

    A limit that it cannot reach at all on some joints stays; where it cannot on half of them, the scenario
    is infeasible.
    """
    rows = {name: np.asarray(getattr(best, name), float) for name in asked.limits}
    values = {
        name: float(np.quantile(row, MOST_JOINTS, method="inverted_cdf"))
        for name, row in rows.items()
    }
    limits = {
        name: max(limit, SLACK * values[name])
        if name != "peak_temperature" and np.isfinite(values[name])
        else limit
        for name, limit in asked.limits.items()
    }
    reason = ""
    if values.get("tracking", 0.0) > HOPELESS:
        reason = f"the best input leaves a tracking error of {values['tracking']:.2f}"
    for name in ("settling_time", "recovery_time"):
        if np.mean(np.isinf(rows.get(name, np.zeros(1)))) > 0.5:
            reason = f"no input reaches the setpoint: {name.replace('_', ' ')} is infinite"
    found = Specification(HARMLESS if reason else limits, values, reason)
    return replace(found, attainable=float(np.mean(found.met_by_best(best))))


def specifications(
    scenarios: Sequence[Scenario],
    best: Mapping[str, Metrics],
    chosen: Mapping[str, float] | None = None,
) -> dict[str, Specification]:
    """Of every scenario what is asked, given what the best input reaches there (`feasible`)."""
    return {one.name: within_reach(wanted(one.course, chosen), best[one.name]) for one in scenarios}


def cvar(values: Float[np.ndarray, " draw"], level: float = 0.95) -> float:
    """Conditional value at risk: the mean of the worst 1 - level of the values.

    min_t t + mean (c - t)_+ / (1 - level): Rockafellar and Uryasev, J. Risk 2 (2000), 21-41. The draw
    at the quantile counts with the share that is left.
    """
    tail = (1.0 - level) * values.size
    ordered = -np.sort(-values)
    return float(ordered @ np.clip(tail - np.arange(values.size), 0.0, 1.0) / tail)
