"""Confusion matrix, rates with intervals, and reliability of the probabilities of a trial."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.stats import beta

from muscle_bayes.discovery.weigh import NONE, PRIOR_NONE, UNKNOWN
from muscle_bayes.report.trial_figure import NOTHING

DETECTABLE = 0.5
"""Least excess misfit, in the error of a reading, of a case that counts as detectable."""
CLOSE = 1.1
"""Largest RMSE of held-out readings, in their own error, that counts as explained."""
BINS = 5
EPS = np.finfo(float).tiny


@dataclass(frozen=True)
class Rate:
    """Successes among cases, with a 95 % interval (Clopper and Pearson)."""

    what: str
    wanted: str
    """Its aim; empty where none is set."""
    hits: int
    cases: int
    low: float
    high: float

    @classmethod
    def of(cls, what: str, wanted: str, outcomes: Sequence[bool]) -> "Rate":
        hits, cases = int(sum(outcomes)), len(outcomes)
        low = beta.ppf(0.025, hits, cases - hits + 1) if hits else 0.0
        high = beta.ppf(0.975, hits + 1, cases - hits) if hits < cases else 1.0
        return cls(what, wanted, hits, cases, float(low), float(high))

    @property
    def share(self) -> float:
        return self.hits / self.cases if self.cases else float("nan")


def rates(outcomes: Sequence[Mapping[str, Any]]) -> list[Rate]:
    """The trial's claims, each over the cases it is about."""
    seen = [one for one in outcomes if one["excess"] >= DETECTABLE]
    single = [one for one in seen if one["kind"] == "single"]
    outside = [one for one in seen if one["kind"] == "outside"]
    none = [one for one in outcomes if one["kind"] == "none"]
    pairs = [one for one in seen if one["kind"] == "pair"]
    return [
        Rate.of("single: named first, or in its tie", ">= 95 %", [_named(one) for one in single]),
        Rate.of("single: named alone", ">= 85 %", [_alone(one) for one in single]),
        Rate.of("none: something claimed", "<= 3 %", [one["verdict"] != [NONE] for one in none]),
        Rate.of("outside: unknown", ">= 90 %", [_unnamed(one) for one in outside]),
        Rate.of("outside: right port", ">= 75 %", [one["port"] in one["ports"] for one in outside]),
        Rate.of(
            "outside: right port, or in its tie", ">= 75 %", [_right_port(one) for one in outside]
        ),
        Rate.of(
            "outside: unknown alone, no name added",
            ">= 80 %",
            [one["verdict"] == [UNKNOWN] for one in outside],
        ),
        Rate.of(
            "single: held-out RMSE within 1.1 of the noise",
            ">= 90 %",
            [one["held_out"] <= CLOSE for one in single],
        ),
        Rate.of(
            "pairs: both found",
            ">= 80 %",
            [_both(one) for one in pairs],
        ),
        Rate.of(
            "pairs: both found, the second detectable beside the first",
            ">= 80 %",
            [_both(one) for one in pairs if _second_seen(one)],
        ),
    ]


def _named(one: Mapping[str, Any]) -> bool:
    return one["verdict"][0] in one["hidden"] or bool(set(one["tie"]) & set(one["hidden"]))


def _alone(one: Mapping[str, Any]) -> bool:
    return one["verdict"] == list(one["hidden"]) and not one["tie"]


def _unnamed(one: Mapping[str, Any]) -> bool:
    """Called unknown, and no wrong name held likelier than not."""
    named = max(p for name, p in one["probabilities"].items() if name not in (NONE, UNKNOWN))
    return UNKNOWN in one["verdict"] and named <= 0.5


def _right_port(one: Mapping[str, Any]) -> bool:
    """Some are the same to some rigs: a tension that depends on strain, and a torque on the angle."""
    return one["port"] in one["ports"] or one["port"] in one["tied_ports"]


def _both(one: Mapping[str, Any]) -> bool:
    return set(one["hidden"]) <= set(one["verdict"])


def _second_seen(one: Mapping[str, Any]) -> bool:
    """Whether the model with the first effect that was found, if it is a hidden one, still misfits."""
    if one["verdict"][0] not in one["hidden"]:
        return True
    return bool(one["excess_left"][0] >= DETECTABLE)


def confusion(outcomes: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, int]]:
    """What was said first, counted by what was hidden; of detectable cases and of none."""
    table: dict[str, Counter[str]] = {}
    for one in outcomes:
        if one["kind"] in ("single", "outside") and one["excess"] >= DETECTABLE:
            table.setdefault(one["hidden"][0], Counter())[one["verdict"][0]] += 1
        elif one["kind"] == "none":
            table.setdefault(NOTHING, Counter())[one["verdict"][0]] += 1
    return {hidden: dict(found) for hidden, found in sorted(table.items())}


@dataclass(frozen=True)
class Bin:
    """Statements of similar probability, and how many were true."""

    said: float
    true: float
    statements: int


def as_presumed(outcomes: Sequence[Mapping[str, Any]]) -> np.ndarray:
    """Weight of each case, such that nothing is hidden as often as probabilities presume."""
    none = np.array([one["kind"] == "none" for one in outcomes])
    share = none.mean() if len(none) else PRIOR_NONE
    return np.where(none, PRIOR_NONE / max(share, EPS), (1.0 - PRIOR_NONE) / max(1.0 - share, EPS))


def reliability(
    outcomes: Sequence[Mapping[str, Any]], weights: np.ndarray
) -> tuple[list[Bin], float]:
    """How often statements came true, by the probability given to them; expected calibration error.

    A statement is the likeliest answer of a case: an effect, none or unknown. Each counts as much as
    its case's weight.
    """
    said, true = [], []
    for one in outcomes:
        answer = max(one["probabilities"], key=lambda name: one["probabilities"][name])
        truth = {"none": [NONE], "outside": [UNKNOWN]}.get(one["kind"], one["hidden"])
        said.append(one["probabilities"][answer])
        true.append(answer in truth)
    given, came = np.array(said, float), np.array(true, float)
    owner = np.minimum((given * BINS).astype(int), BINS - 1)
    found, error = [], 0.0
    for k in np.unique(owner):
        inside = owner == k
        weight = weights[inside]
        group = Bin(
            float(np.average(given[inside], weights=weight)),
            float(np.average(came[inside], weights=weight)),
            int(inside.sum()),
        )
        error += abs(group.said - group.true) * float(weight.sum())
        found.append(group)
    return found, error / float(weights.sum()) if len(said) else 0.0


def power(outcomes: Sequence[Mapping[str, Any]]) -> dict[str, list[tuple[float, bool]]]:
    """Of each effect hidden alone: strength, and whether it was named first or in its tie.

    Strength is the nominal model's largest misfit in any run, in the error of a reading.
    """
    found: dict[str, list[tuple[float, bool]]] = {}
    for one in outcomes:
        if one["kind"] == "single":
            found.setdefault(one["hidden"][0], []).append((one["excess"], _named(one)))
    return {name: sorted(found[name]) for name in sorted(found)}


def counted(outcomes: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """All numbers of a trial, as JSON takes them."""
    bins, error = reliability(outcomes, np.ones(len(outcomes)))
    _, presumed = reliability(outcomes, as_presumed(outcomes))
    return {
        "cases": len(outcomes),
        "kinds": dict(Counter(one["kind"] for one in outcomes)),
        "rigs": dict(Counter(one["rig"] for one in outcomes)),
        "rates": [{**asdict(one), "share": one.share} for one in rates(outcomes) if one.cases],
        "power": power(outcomes),
        "confusion": confusion(outcomes),
        "reliability": [asdict(one) for one in bins],
        "calibration_error": error,
        "calibration_error_as_presumed": presumed,
    }
