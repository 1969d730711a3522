"""Gains of an antagonistic joint: tuned for all draws, tested on draws that were not used."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from muscle_bayes.control.batch import Bank
from muscle_bayes.control.closed_loop import Clock
from muscle_bayes.control.criteria import Criterion, CVaR, MeanCost, cvar
from muscle_bayes.control.draws import JointDraws
from muscle_bayes.control.gains import Gains, gains_toml
from muscle_bayes.control.header import gains_header, on_the_bench
from muscle_bayes.control.linear import snapshot_gains
from muscle_bayes.control.scenario import Scenario
from muscle_bayes.control.scenarios import STEP, thesis_scenarios
from muscle_bayes.control.study import Robustness, robustness, runaway_curve
from muscle_bayes.control.tune import Effort, tune
from muscle_bayes.json_file import write_json
from muscle_bayes.report.control_figures import responses_figure, runaway_figure
from muscle_bayes.report.risk_figure import RiskCurve, risk_figure
from muscle_bayes.study.plan import Plan
from muscle_bayes.study.steps.figures import Drawn, origin_of
from muscle_bayes.study.steps.joints import draws_of
from muscle_bayes.study.worker import Report
from muscle_bayes.whole_file import write_whole


@dataclass(frozen=True)
class Size:
    """How much is spent on the controller."""

    tuned_on: int
    """draws"""
    kept: int
    """draws that gains are judged on"""
    effort: Effort
    scenarios: tuple[str, ...] | None
    """of the thesis' nine that gains are tuned for; None: all"""
    swept: int
    """gains of the risk curve"""


SIZES: Final = {
    "quick": Size(
        16,
        48,
        Effort(starts=8, scout_draws=8, refined=1, steps=4),
        ("step", "load-step", "setpoint-sine-0.1592"),
        5,
    ),
    "full": Size(48, 256, Effort(starts=32, refined=1, steps=10), None, 9),
}
SPREAD: Final = 8.0
"""The risk curve reaches from gains this much smaller to gains this much larger."""
SHARES: Final = ("unstable", "unsafe")


def make(plan: Plan, name: str, report: Report) -> None:
    """Write results/control.json, gains.toml, gains.h and figures."""
    size, seed = SIZES[plan.preset], plan.config.seed
    joints, notes = draws_of(plan, size.tuned_on + size.kept)
    tuned_on, kept = joints.split(size.tuned_on)
    gains = _tuned(tuned_on, size, seed, report)
    clock = Clock(gains["robust"].period)
    scenarios = thesis_scenarios(gains["robust"].period)
    bank, middle = Bank(kept, clock, seed + 1), Bank(tuned_on.mean(), clock, seed + 1)
    judged = {key: robustness(bank, one, scenarios, notes=notes) for key, one in gains.items()}
    nominal = {key: robustness(middle, one, scenarios) for key, one in gains.items()}
    report("risk", 0, 1)
    aims = _tuned_for(size, gains["robust"].period)
    curve = _risk(bank, gains["robust"], aims, size.swept)
    runaway = runaway_curve(bank, gains["robust"])
    head = f"95 % CVaR over {size.tuned_on} draws, for {', '.join(one.name for one in aims)}"
    head += "\n" + "\n".join(notes)
    write_whole(plan.out / "gains.toml", gains_toml(gains["robust"], head).encode())
    header = gains_header(gains["robust"], joints.design, head)
    write_whole(plan.out / "gains.h", header.encode())
    origin = origin_of(plan.runs(plan.roles.fitted))
    drawn = Drawn(plan)
    _draw(drawn, judged["robust"], gains, curve, origin)
    drawn.add(
        "runaway",
        runaway_figure(runaway),
        "How fast the setpoint may move: error relative to the setpoint (median and 90 % of draws), and "
        "probability of runaway, against the frequency of a setpoint sine.",
        origin,
    )
    write_json(
        plan.result(name),
        {
            "notes": notes,
            "tuned_on": size.tuned_on,
            "kept_apart": size.kept,
            "scenarios_tuned_for": [one.name for one in aims],
            "gains": {key: one.model_dump(exclude_none=True) for key, one in gains.items()},
            "rows": _rows(judged, nominal),
            "robust": judged["robust"].as_dict(),
            "risk": curve.as_dict(),
            "runaway": runaway.as_dict(),
            "figures": drawn.listed,
        },
    )


def _tuned_for(size: Size, period: float) -> list[Scenario]:
    """The scenarios that gains are tuned for."""
    every = thesis_scenarios(period)
    return [one for one in every if size.scenarios is None or one.name in size.scenarios]


def _tuned(draws: JointDraws, size: Size, seed: int, report: Report) -> dict[str, Gains]:
    """PI with anti-windup for all draws and for their mean, and PI as the thesis tuned it."""
    blank = Gains(law="pi-antiwindup", proportional=1.0, integral=1.0)
    scenarios = _tuned_for(size, blank.period)

    def one(on: JointDraws, criterion: Criterion) -> Gains:
        bank = Bank(on, Clock(blank.period), seed)
        found = tune(
            bank, scenarios, criterion, blank, effort=size.effort, seed=seed, report=report
        )
        return on_the_bench(found.gains, draws.design)

    return {
        "robust": one(draws, CVaR()),
        "point": one(draws.mean(), MeanCost()),
        "thesis": snapshot_gains(draws, STEP),
    }


def _risk(bank: Bank, gains: Gains, scenarios: Sequence[Scenario], count: int) -> RiskCurve:
    """Costs over the draws with all gains multiplied by the same factors."""
    rows = []
    for factor in np.geomspace(1.0 / SPREAD, SPREAD, count):
        both = {key: factor * getattr(gains, key) for key in ("proportional", "integral")}
        found = robustness(bank, gains.model_copy(update=both), scenarios).outcomes.values()
        costs = np.mean([one.cost for one in found], axis=0)
        worst = [max(float(np.mean(getattr(one.metrics, key))) for one in found) for key in SHARES]
        tail = float(np.mean([cvar(one.cost, 0.95) for one in found]))
        rows.append((both["proportional"], np.quantile(costs, [0.05, 0.5, 0.95]), tail, *worst))
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return RiskCurve(*columns)


def _draw(
    drawn: Drawn, result: Robustness, gains: Mapping[str, Gains], curve: RiskCurve, origin: str
) -> None:
    drawn.add(
        "control-responses",
        responses_figure(result),
        "The recommended gains in every scenario: setpoint, median angle, bands with 50 and 90 % of the "
        "draws. None of these draws was used for tuning.",
        origin,
    )
    marked = {key: one.proportional for key, one in gains.items()}
    drawn.add(
        "risk",
        risk_figure(curve, marked),
        "Cost, and probability of runaway in the worst scenario, as all recommended gains are multiplied "
        "alike. Vertical lines: gains tuned for all draws (robust), for their mean (point), and by the "
        "thesis' method.",
        origin,
    )


def _rows(
    judged: Mapping[str, Robustness], nominal: Mapping[str, Robustness]
) -> list[dict[str, Any]]:
    """Of every scenario and gains: risk, runaways, and cost on the mean joint."""
    rows = []
    for scenario in judged["robust"].scenarios:
        row: dict[str, Any] = {"scenario": scenario.name, "about": scenario.about}
        for key, result in judged.items():
            outcome = result.outcomes[scenario.name]
            away = np.maximum(outcome.metrics.unstable, outcome.metrics.unsafe) > 0
            row[key] = {
                "cvar95": cvar(outcome.cost, 0.95),
                "median": float(np.median(outcome.cost)),
                "runaway": float(np.mean(away)),
                "nominal": float(nominal[key].outcomes[scenario.name].cost[0]),
            }
        rows.append(row)
    return rows
