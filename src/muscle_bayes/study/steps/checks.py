"""What the data say of a fit, what its priors allow, and its predictions beside readings."""

from dataclasses import replace
from typing import Any

import numpy as np

from muscle_bayes.criticism.coverage import RunCheck, check_run
from muscle_bayes.criticism.drift import drift
from muscle_bayes.data import Run
from muscle_bayes.inference.posteriors.identifiability import Identifiability, identify
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.posteriors.predict import Prediction
from muscle_bayes.inference.posteriors.predictive import predict_from_prior, predict_runs
from muscle_bayes.inference.posteriors.summary import summarise
from muscle_bayes.json_file import write_json
from muscle_bayes.progress import Report
from muscle_bayes.report.pairs_figure import pairs_figure
from muscle_bayes.report.posterior_figures import identifiability_figure, posterior_figure
from muscle_bayes.report.predictive_figures import (
    drift_figure,
    predictive_figure,
    prior_predictive_figure,
)
from muscle_bayes.study.plan import Plan
from muscle_bayes.study.published import middles, values_of
from muscle_bayes.study.steps.figures import Drawn, origin_of


def make(plan: Plan, name: str, report: Report) -> None:
    """Write results/NAME.json and figures: NAME is `fixture-checks` or `muscle-checks`."""
    part = name.removesuffix("-checks")
    moved = part == "muscle"
    fit = "muscle" if moved else f"fixture-{plan.config.friction}"
    fitted = plan.fitted(plan.roles.muscle if moved else plan.roles.fixture)
    held = [run for run in plan.runs(plan.roles.held_out) if run.has_muscle == moved]
    posterior = Posterior.load(plan.posterior(fit))
    drawn = Drawn(plan)
    report("what is identified", 0, 3)
    found = identify(posterior)
    _draw_posterior(plan, drawn, part, posterior, found, origin_of(fitted))
    report("what priors allow", 1, 3)
    _draw_prior(plan, drawn, part, posterior, fitted)
    report("predictions", 2, 3)
    predicted = _predictions(plan, posterior, [*fitted, *held])
    write_json(
        plan.result(name),
        {
            "summary": summarise(posterior),
            "identifiability": found.as_dict(),
            **_judged(plan, drawn, predicted, {run.name: run for run in (*fitted, *held)}),
            "figures": drawn.listed,
        },
    )


def _draw_posterior(
    plan: Plan, drawn: Drawn, part: str, posterior: Posterior, found: Identifiability, origin: str
) -> None:
    fits = (posterior.friction, "muscle") if part == "muscle" else (posterior.friction,)
    printed = middles(values_of(plan.published, *fits))
    mark = " Dashed red line: the published value." if printed else ""
    drawn.add(
        f"posterior-{part}",
        posterior_figure(posterior, printed, part),
        f"What the runs say of the {part}'s parameters: posterior in blue, its central 90 % filled, prior "
        f"in grey.{mark}",
        origin,
    )
    drawn.add(
        f"pairs-{part}",
        pairs_figure(posterior, printed),
        "Posterior of pairs of parameters: regions that hold 50 and 90 % of the draws. A slanted, narrow "
        "region means that only a combination of the two is known." + mark,
        origin,
    )
    given = ("J", "D") if part == "muscle" and plan.roles.fixture else ()
    shown = {
        name: one
        for name, one in found.parameters.items()
        if name in posterior.parameters and name not in given
    }
    drawn.add(
        f"identifiability-{part}",
        identifiability_figure(replace(found, parameters=shown)),
        "How far the data narrow each parameter. 1: known exactly; 0: no better than before. It is 1 minus "
        "the width of the posterior's 90 % interval over that of the prior's."
        + (
            " Hatched: at a bound of its prior."
            if any(one.edge for one in found.parameters.values())
            else ""
        ),
        origin,
    )


def _draw_prior(plan: Plan, drawn: Drawn, part: str, posterior: Posterior, runs: list[Run]) -> None:
    # All runs as in the fit, for the programs compiled there; two are enough to look at.
    prior = predict_from_prior(runs, posterior.friction, posterior.effects, seed=plan.config.seed)
    unsolved = prior[0].unsolved
    count = unsolved + len(prior[0].model)
    drawn.add(
        f"prior-{part}",
        prior_predictive_figure(prior[:2], runs[0].metadata.origin),
        "Before any fit, the model allows all of this: central 50 and 90 % of models drawn from the prior, "
        "without noise, and what was logged."
        + (f" {unsolved} of {count} draws cannot be solved and are left out." if unsolved else ""),
        origin_of(runs[:2]),
    )


def _predictions(plan: Plan, posterior: Posterior, runs: list[Run]) -> list[Prediction]:
    """Of whole runs; what lies behind the fitted part of a run counts as predicted ahead."""
    whole = plan.runs([run.name for run in runs])
    found = predict_runs(posterior, whole, seed=plan.config.seed)
    return [
        one if (end := plan.roles.until.get(one.run)) is None else one._replace(ahead_from=end)
        for one in found
    ]


def residuals_of(one: Prediction, most: int = 600) -> dict[str, Any]:
    """Readings minus the mean model, and the predictions' bands about it, at `most` times."""
    at = np.unique(np.linspace(0, one.time.size - 1, most).astype(int))
    mean = one.model.mean(axis=0)[at]
    levels = {"q05": 0.05, "q25": 0.25, "q75": 0.75, "q95": 0.95}
    ends = np.quantile(one.reading[:, at] - mean, list(levels.values()), axis=0)
    columns = {"time": one.time[at], "residual": one.observed[at] - mean}
    columns |= dict(zip(levels, ends, strict=True))
    rounded = {name: [float(f"{x:.4g}") for x in column] for name, column in columns.items()}
    return {"unit": one.unit, **rounded}


def _predicted_caption(run: str, check: RunCheck, held_out: bool) -> str:
    return (
        f"Run {run}{', which was not fitted' if held_out else ''}: predicted to {check.rmse:.2g} "
        f"{check.unit} RMS, with {check.coverage90:.0%} of the readings in the central 90 % of the "
        "predictions. Bottom: readings minus the mean model, with the predictions' bands."
    )


def _judged(
    plan: Plan, drawn: Drawn, predicted: list[Prediction], runs: dict[str, Run]
) -> dict[str, Any]:
    """Checks of every run, and creep of those that were not fitted, or not wholly."""
    checks, drifts = {}, {}
    for one in predicted:
        run = runs[one.run]
        check = check_run(one)
        ahead = one.run in plan.roles.held_out or one.run in plan.roles.until
        checks[one.run] = check.as_dict() | {"ahead": ahead, "residuals": residuals_of(one)}
        drawn.add(
            f"predicted-{one.run}",
            predictive_figure(one, check, run.metadata.origin),
            _predicted_caption(one.run, check, one.run in plan.roles.held_out),
            origin_of([run]),
        )
        if ahead and run.has_muscle:
            found = drift(one, plan.config.seed)
            drifts[one.run] = found.as_dict()
            if not found.phases:
                continue
            drawn.add(
                f"drift-{one.run}",
                drift_figure(one, found, run.metadata.origin),
                f"Creep of run {one.run} while cold, each phase from its own start. Below: measured and "
                "predicted slopes with their 90 % intervals.",
                origin_of([run]),
            )
    return {"checks": checks, "drift": drifts}
