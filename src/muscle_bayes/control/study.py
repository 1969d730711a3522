"""From draws of joints to judged laws: what is asked, gains of every law, and how they do on new joints."""

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from muscle_bayes.control.batch import Bank
from muscle_bayes.control.closed_loop import Clock
from muscle_bayes.control.judging.feasible import feasible
from muscle_bayes.control.judging.judge import Judgement, judge
from muscle_bayes.control.judging.specification import Specification, cvar, specifications
from muscle_bayes.control.laws.gains import Gains, LawName
from muscle_bayes.control.laws.templates import TUNED, template
from muscle_bayes.control.linear import snapshot_gains
from muscle_bayes.control.plant.draws import JointDraws
from muscle_bayes.control.scenarios.scenario import Scenario
from muscle_bayes.control.scenarios.thesis import STEP
from muscle_bayes.control.tune import Effort, tune
from muscle_bayes.progress import Report, silent

SIMPLER: Final[Mapping[str, tuple[LawName, ...]]] = {
    "two-degrees": ("pi",),
    "feedforward": ("two-degrees", "pi"),
}
"""Laws that are special cases of others, nearly: their gains are tried there, too."""


class TunedLaws(NamedTuple):
    """Laws tuned on some joints and judged on others."""

    judgement: Judgement
    bank: Bank
    """The joints that they were judged on."""
    edges: dict[str, tuple[str, ...]]
    """Of every law the gains at an edge of the search."""
    least: dict[str, float]
    """95 % CVaR of the excess under the best input, in scenarios whose limits it does not always keep."""


def asked(
    draws: JointDraws,
    scenarios: Sequence[Scenario],
    limits: Mapping[str, float] | None = None,
    period: float = 0.03,
    report: Report = silent,
) -> dict[str, Specification]:
    """What is asked of every scenario, given what the best input reaches on most joints."""
    return specifications(scenarios, feasible(draws, scenarios, period, report=report), limits)


def tuned_laws(
    joints: JointDraws,
    tuned_on: int,
    scenarios: Sequence[Scenario],
    *,
    laws: Sequence[LawName] = TUNED,
    limits: Mapping[str, float] | None = None,
    effort: Effort | None = None,
    rivals: Mapping[str, tuple[LawName, JointDraws]] | None = None,
    period_ms: int = 30,
    notes: Sequence[str] = (),
    looked_at: int | None = None,
    seed: int = 0,
    report: Report = silent,
) -> TunedLaws:
    """Tune every law on the first `tuned_on` joints and judge it on the others, thesis' gains beside it.

    `rivals` are laws that are tuned on other joints, such as those of one specimen alone, and judged alike.
    Where some joints cannot keep a scenario's limits with any input, `looked_at` of the others are told
    apart by their best input (default: as `feasible`).
    """
    clock = Clock(period_ms / 1000.0)
    first, others = joints.split(tuned_on)
    specs = asked(first, scenarios, limits, clock.period, report)
    edges: dict[str, tuple[str, ...]] = {}
    gains: dict[str, Gains] = {}
    chosen = {law: (law, first) for law in laws} | dict(rivals or {})
    for name, (law, on) in chosen.items():
        made, bank = template(law, on, period_ms), Bank(on, clock, seed)
        simpler = [gains[one] for one in SIMPLER.get(name, ()) if one in gains]
        found = tune(
            bank, scenarios, specs, made, known=simpler, effort=effort, seed=seed, report=report
        )
        gains[name], edges[name] = found.gains, found.edges
    gains["thesis"] = snapshot_gains(first, STEP, period_ms=period_ms)
    test = Bank(others, clock, seed + 1)
    told = (*notes, f"tuned on {tuned_on} joints, judged on {len(others)} others")
    unsure = [one for one in scenarios if specs[one.name].attainable < 1.0]
    best = feasible(others, unsure, clock.period, joints=looked_at, report=report)
    possible = {name: specs[name].met_by_best(found) for name, found in best.items()}
    result = judge(test, gains, scenarios, specs, notes=told, possible=possible, report=report)
    least = {name: cvar(specs[name].worst_of_best(found)) for name, found in best.items()}
    return TunedLaws(result, test, edges, least)
