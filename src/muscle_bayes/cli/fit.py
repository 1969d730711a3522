"""`muscle-bayes fit`: a posterior from runs."""

import sys
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from muscle_bayes.cli.common import (
    EXIT_FAILED,
    DeviceOption,
    JsonOption,
    RunsArgument,
    SeedOption,
    compute_on,
    option,
    writable_file,
    write_json,
)

FrictionOption = Annotated[
    Literal["coulomb", "linear"],
    typer.Option("--friction", help="Dry friction that sticks, or friction per speed."),
]
EffectOption = Annotated[
    list[str] | None, option("NAME", "Add this effect to the model; may be repeated.", "--effect")
]
GivenOption = Annotated[
    Path | None, option("POSTERIOR.nc", "Fixture posterior to use as prior of J and D.")
]
Preset = Literal["quick", "full"]


def fit(
    runs: RunsArgument,
    out: Annotated[
        Path, option("POSTERIOR.nc", "Where the posterior goes.", callback=writable_file)
    ],
    friction: FrictionOption = "coulomb",
    effect: EffectOption = None,
    given: GivenOption = None,
    until: Annotated[float | None, option("S", "Fit only rows before this time, s.")] = None,
    broken_off: Annotated[
        bool,
        typer.Option(
            "--broken-off",
            help="Also fit runs that broke off and were recorded again (NAME-again).",
        ),
    ] = False,
    preset: Annotated[Preset, typer.Option(help="How long to sample.")] = "full",
    device: DeviceOption = "cpu",
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """Estimate everything that is unknown about RUN... and write the posterior.

    The runs decide which parameters are estimated. Spring and free runs identify J and D; heated
    runs identify the muscle's nine. Exits with 1 if the chains have not converged,
    or the model does not explain the runs.

    Examples:
        muscle-bayes fit data/spring-*.csv --out fixture.nc
        muscle-bayes fit data/staircase-*.csv --given fixture.nc --out muscle.nc
    """
    from muscle_bayes.data import find_runs, read_runs, recording_of, without_broken_off
    from muscle_bayes.inference.posteriors.posterior import Posterior
    from muscle_bayes.inference.posteriors.summary import summarise
    from muscle_bayes.inference.sampling.fit import EFFORTS
    from muscle_bayes.inference.sampling.fit import fit as fit_runs
    from muscle_bayes.progress import shown_progress

    compute_on(device)
    logs = find_runs(runs)
    if not broken_off:
        logs, left_out = without_broken_off(logs)
        for told in left_out:
            typer.echo(told, err=True)
    for log in logs:
        if (made := recording_of(log)) is not None and not made.complete:
            typer.echo(f"{log}: {made}", err=True)
    loaded = read_runs(logs)
    if until is not None:
        loaded = [run.until(until) for run in loaded]
    known = None if given is None else Posterior.load(given)
    with shown_progress() as report:
        posterior = fit_runs(
            loaded,
            friction,
            tuple(effect or ()),
            effort=EFFORTS[preset],
            given=known,
            seed=seed,
            report=report,
        )
    posterior.save(out)
    summary = summarise(posterior)
    print_summary(summary)
    typer.echo(f"posterior: {out}")
    write_json(json, summary)
    if not (posterior.converged and summary["explained"]):
        raise typer.Exit(EXIT_FAILED)


def print_summary(summary: dict[str, Any]) -> None:
    """Print a summary's tables."""
    from rich.console import Console
    from rich.table import Table

    from muscle_bayes.markup import unit_of

    # A file or pipe has no width of its own; numbers must not be cut.
    console = Console(width=None if sys.stdout.isatty() else 120)
    table = Table("parameter", "unit", "mean", "sd", "5 %", "95 %", "R-hat", "bulk ESS")
    for column in table.columns:
        column.overflow = "fold"
    for name, row in summary["parameters"].items():
        numbers = [f"{row[key]:.5g}" for key in ("mean", "sd", "q05", "q95")]
        table.add_row(
            name, unit_of(row["unit"]), *numbers, f"{row['rhat']:.3f}", f"{row['ess_bulk']:.0f}"
        )
    console.print(table)
    fits = Table("run", "RMSE", "unit", "90 % coverage")
    for name, row in summary["runs"].items():
        fits.add_row(name, f"{row['rmse']:.4g}", row["unit"], f"{row['coverage90']:.0%}")
    console.print(fits)
    for name, row in summary["runs"].items():
        if (inertia := row.get("inertia")) and inertia["kept"]:
            console.print(
                f"{name}: solved with the rotor's inertia; without it readings differ by "
                f"{inertia['rms']:.2g} {row['unit']} RMS"
            )
    if summary["converged"]:
        console.print("converged", style="green")
    else:
        console.print("NOT CONVERGED", style="bold red")
        for reason in summary["complaints"]:
            console.print(f"  {reason}", highlight=False)
    if tied := summary["only_ratios"]:
        console.print(
            f"only ratios are identified of {', '.join(tied)}. "
            "Fix: state a mass, an inertia or a force, if one is known; let what is held move.",
            highlight=False,
        )
    if summary["explained"]:
        console.print("explained: yes", style="green")
    else:
        reasons = "; ".join(summary["unexplained"])
        console.print(f"explained: no. {reasons}.", style="bold red", highlight=False)
        console.print(
            "Fix: `muscle-bayes discover` looks for what is missing; check masses, lengths and units."
        )
