"""`muscle-bayes population`: what specimens say of the muscle that comes next."""

from pathlib import Path
from typing import Annotated

import typer

from muscle_bayes.cli.common import (
    JsonOption,
    SeedOption,
    option,
    writable_file,
    write_json,
)


def population(
    specimens: Annotated[
        list[Path],
        typer.Argument(
            metavar="SPECIMEN...",
            help="Posteriors of one muscle each (.nc), or runs and folders of runs whose metadata name "
            "the specimen under [element_a].",
        ),
    ],
    out: Annotated[Path, option("POPULATION.nc", "Where it goes.", callback=writable_file)],
    given: Annotated[
        Path | None, option("FIXTURE.nc", "Posterior of J and D, which specimens share.")
    ] = None,
    spread: Annotated[
        float,
        typer.Option(min=0.001, max=1.0, help="Prior median of the relative spread of specimens."),
    ] = 0.08,
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """Fit every specimen, and the mean and spread of the population that they come from.

    With one specimen the spread is its prior. `tune` and `robustness` take the result.

    Examples:
        muscle-bayes population data/lot --given fixture.nc --out population.nc
        muscle-bayes population m1.nc m2.nc --out population.nc
    """
    from muscle_bayes.data import find_runs, read_runs
    from muscle_bayes.inference.population import fit_population
    from muscle_bayes.inference.population.specimens import by_specimen, fit_specimens
    from muscle_bayes.inference.posteriors.posterior import Posterior
    from muscle_bayes.progress import shown_progress

    posteriors = {path.stem: Posterior.load(path) for path in specimens if path.suffix == ".nc"}
    places = [path for path in specimens if path.suffix != ".nc"]
    known = None if given is None else Posterior.load(given)
    if places:
        runs = by_specimen(read_runs(find_runs(places)))
        with shown_progress() as report:
            posteriors |= fit_specimens(runs, given=known, seed=seed, report=report)
    found = fit_population(posteriors, spread=spread, seed=seed)
    found.save(out)
    typer.echo(repr(found))
    for name, one in posteriors.items():
        if not one.converged:
            typer.echo(f"{name} HAS NOT CONVERGED: {'; '.join(one.complaints)}", err=True)
    typer.echo(f"population: {out}")
    table = found.summary().to_dict(orient="index")
    write_json(json, {"specimens": list(posteriors), "population": table, "seed": seed})
