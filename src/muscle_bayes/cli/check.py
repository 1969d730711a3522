"""`muscle-bayes check`: what a posterior says of runs, fitted or not, beside what was logged."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from muscle_bayes.cli.common import (
    EXIT_FAILED,
    DeviceOption,
    FittedArgument,
    FolderOption,
    JsonOption,
    RunsArgument,
    SeedOption,
    compute_on,
    write_json,
)

if TYPE_CHECKING:
    from rich.console import Console

    from muscle_bayes.criticism.coverage import RunCheck
    from muscle_bayes.criticism.drift import Drift

_FIGURES = Path("reports/check")


def check(
    posterior: FittedArgument,
    runs: RunsArgument,
    json: JsonOption = None,
    out: FolderOption = _FIGURES,
    device: DeviceOption = "cpu",
    seed: SeedOption = 0,
) -> None:
    """Predict RUN..., fitted or not, and measure how well the predictions agree with the readings.

    For each run: RMSE of the mean model, and the share of readings within the central 50 and 90 %
    of the predictions. Also creep while cold after heating. Exits with 1 if the posterior has not
    converged.

    Examples:
        muscle-bayes check muscle.nc data/sawtooth.csv
        muscle-bayes check fixture.nc data/spring-*.csv --out reports/check --json check.json
    """
    from rich.console import Console

    from muscle_bayes.criticism.coverage import check_run
    from muscle_bayes.criticism.drift import drift as drift_of
    from muscle_bayes.data import read_runs
    from muscle_bayes.inference.posteriors.posterior import Posterior
    from muscle_bayes.inference.posteriors.predictive import predict_runs
    from muscle_bayes.progress import shown_progress
    from muscle_bayes.report.predictive_figures import drift_figure, predictive_figure
    from muscle_bayes.report.style import save

    compute_on(device)
    fitted = Posterior.load(posterior)
    loaded = read_runs(runs)
    origins = {run.name: run.metadata.origin for run in loaded}
    console = Console()
    with shown_progress() as report:
        report("predicting", 0, 1)
        predictions = predict_runs(fitted, loaded, seed=seed)
        report("predicting", 1, 1)
    checks: dict[str, RunCheck] = {}
    drifts: dict[str, Drift] = {}
    for one in predictions:
        checks[one.run], drifts[one.run] = check_run(one), drift_of(one, seed)
        figure = predictive_figure(one, checks[one.run], origins[one.run])
        save(figure, out / f"{one.run}.png")
        if drifts[one.run].phases:
            figure = drift_figure(one, drifts[one.run], origins[one.run])
            save(figure, out / f"{one.run}-drift.png")
    _show(console, checks, drifts)
    for one in predictions:
        if one.unsolved:
            count = one.unsolved + len(one.model)
            console.print(
                f"{one.run}: left out {one.unsolved} of {count} draws, in which it cannot be solved"
            )
    found: dict[str, Any] = {
        "runs": {name: one.as_dict() for name, one in checks.items()},
        "drift": {name: one.as_dict() for name, one in drifts.items()},
        "converged": fitted.converged,
        "complaints": fitted.complaints,
        "seed": seed,
    }
    write_json(json, found)
    typer.echo(f"figures: {out}")
    if not fitted.converged:
        warning = "POSTERIOR NOT CONVERGED: " + "; ".join(fitted.complaints)
        console.print(warning, style="bold red", markup=False, highlight=False)
        raise typer.Exit(EXIT_FAILED)


def _show(console: "Console", checks: dict[str, "RunCheck"], drifts: dict[str, "Drift"]) -> None:
    """The tables of all runs; creep only where a run has cold phases."""
    from muscle_bayes.report.tables import shown, table

    rows = []
    for name, one in checks.items():
        rmse, judged = f"{one.rmse:.3g} {one.unit}", f"{one.judged_rmse:.3g} {one.judged_unit}"
        second = judged if one.unit != one.judged_unit else ""
        rows.append((name, rmse, second, f"{one.coverage50:.0%}", f"{one.coverage90:.0%}"))
    console.print(shown(table(("run", "RMSE", "", "in 50 %", "in 90 %"), rows)))
    creep = []
    for name, drift in drifts.items():
        if (d := drift.slope_difference) is not None:
            mean, interval = f"{d.mean:+.3g} {drift.unit}/min", f"{d.q05:+.3g} to {d.q95:+.3g}"
            creep.append((name, str(len(drift.phases)), mean, interval))
    if creep:
        columns = ("creep while cold", "phases", "measured - predicted", "90 % interval")
        console.print(shown(table(columns, creep)))
