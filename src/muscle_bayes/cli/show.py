"""`muscle-bayes show`: a saved posterior as table and figures."""

from pathlib import Path

import typer

from muscle_bayes.cli.common import (
    EXIT_FAILED,
    FittedArgument,
    FolderOption,
    JsonOption,
    write_json,
)


def show(
    posterior: FittedArgument,
    out: FolderOption = Path("reports/show"),
    json: JsonOption = None,
) -> None:
    """Show a saved posterior: table of parameters, what the data cannot identify, and figures.

    Draws the posterior of each parameter beside its prior, and of pairs of parameters. Exits with 1
    if the posterior has not converged.

    Examples:
        muscle-bayes show fixture.nc
        muscle-bayes show muscle.nc --out reports/show --json muscle.json
    """
    from muscle_bayes.cli.fit import print_summary
    from muscle_bayes.inference.posteriors.identifiability import identify
    from muscle_bayes.inference.posteriors.posterior import Posterior
    from muscle_bayes.inference.posteriors.summary import summarise
    from muscle_bayes.report.pairs_figure import pairs_figure
    from muscle_bayes.report.posterior_figures import posterior_figure
    from muscle_bayes.report.style import save

    fitted = Posterior.load(posterior)
    summary, known = summarise(fitted), identify(fitted)
    print_summary(summary)
    typer.echo(known.text())
    save(posterior_figure(fitted, label=posterior.stem), out / f"{posterior.stem}.png")
    save(pairs_figure(fitted), out / f"{posterior.stem}-pairs.png")
    typer.echo(f"figures: {out}")
    write_json(json, {**summary, "identifiability": known.as_dict()})
    if not fitted.converged:
        raise typer.Exit(EXIT_FAILED)
