"""`muscle-bayes demo`: inertia and friction from one shipped run, and a prediction of another."""

from pathlib import Path

import typer

from muscle_bayes.cli.common import (
    EXIT_FAILED,
    FolderOption,
    JsonOption,
    SeedOption,
    compute_on,
    write_json,
)

FITTED, PREDICTED = "spring-1", "spring-5"


def demo(
    out: FolderOption = Path("reports/demo"),
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """Estimate a rotor's inertia and friction from one shipped run, and predict another.

    A weight on a reference spring is released, and the rotor swings until friction stops it. The data
    are synthetic, so the true values are known.

    Examples:
        muscle-bayes demo
        muscle-bayes demo --out reports/demo --json demo.json
    """
    compute_on("cpu")
    from muscle_bayes.criticism.coverage import check_run
    from muscle_bayes.examples import load_example
    from muscle_bayes.inference.posteriors.predictive import predict_runs
    from muscle_bayes.inference.sampling.fit import EFFORTS, fit
    from muscle_bayes.progress import shown_progress
    from muscle_bayes.report.posterior_figures import posterior_figure
    from muscle_bayes.report.predictive_figures import predictive_figure
    from muscle_bayes.report.style import save

    with shown_progress() as report:
        posterior = fit(load_example(FITTED), effort=EFFORTS["quick"], seed=seed, report=report)
    posterior.save(out / "fixture.nc")
    (other,) = load_example(PREDICTED)
    (prediction,) = predict_runs(posterior, [other], seed=seed)
    check = check_run(prediction)
    save(posterior_figure(posterior, label=FITTED), out / "posterior.png")
    save(predictive_figure(prediction, check, "synthetic"), out / "prediction.png")
    typer.echo(f"{posterior!r}\n")
    typer.echo(
        f"{PREDICTED} was not fitted. It is predicted to {check.rmse:.2g} {check.unit} RMS, and "
        f"{check.coverage90:.0%} of its readings lie in the central 90 %."
    )
    typer.echo(f"posterior and figures: {out}")
    typer.echo("next: muscle-bayes init YOURLOG.csv, or muscle-bayes study --preset quick")
    parameters = posterior.summary().to_dict("index")
    write_json(
        json,
        {"converged": posterior.converged, "parameters": parameters, "check": check.as_dict()},
    )
    if not posterior.converged:
        raise typer.Exit(EXIT_FAILED)
