"""`muscle-bayes discover`: which effect is missing from the model of these runs?"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from muscle_bayes.cli.common import (
    EXIT_FAILED,
    DeviceOption,
    FolderOption,
    JsonOption,
    RunsArgument,
    SeedOption,
    compute_on,
    option,
    write_json,
)
from muscle_bayes.cli.fit import EffectOption, FrictionOption, Preset

if TYPE_CHECKING:
    from muscle_bayes.discovery.result import Discovery


def discover(
    runs: RunsArgument,
    out: FolderOption = Path("reports/discovery"),
    hold_out: Annotated[
        list[str] | None,
        option(
            "NAME",
            "Predict this run. Only its first part is used, for its own zero and start. "
            "May be repeated.",
        ),
    ] = None,
    friction: FrictionOption = "coulomb",
    effect: EffectOption = None,
    budget: Annotated[
        float | None,
        option("MINUTES", "Give the best answer by then. [default: no limit]", min=0.0),
    ] = None,
    smallest: Annotated[
        float,
        option(
            "STEPS",
            "RMS misfit that counts, in steps of the sensor; smaller misfit is reported, not claimed. "
            "Of a sensor finer than its noise: in standard deviations of a reading.",
            min=0.0,
        ),
    ] = 0.25,
    preset: Annotated[
        Preset, typer.Option(help="How long the final posterior is sampled.")
    ] = "quick",
    device: DeviceOption = "cpu",
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """Find where the model of RUN... disagrees with them, name the missing effect, and add it.

    First says which effects these runs could show at all. An interrupt (Ctrl-C), or --budget, ends the
    search with the best answer so far. Says "none" where nothing is missing, and "unknown" where no
    named effect explains the misfit.
    It also names effects that the data cannot distinguish. The revised model is then fitted in full, to
    the readings that were searched. Exits with 1 if that fit has not converged.

    Examples:
        muscle-bayes discover data/staircase-*.csv data/sawtooth.csv --hold-out sawtooth
        muscle-bayes discover runs --out reports/discovery --preset full
    """
    from rich.console import Console

    from muscle_bayes.data import read_runs
    from muscle_bayes.discovery.discover import discover as search
    from muscle_bayes.discovery.nominal import seen_parts
    from muscle_bayes.inference.sampling.fit import EFFORTS, fit
    from muscle_bayes.progress import shown_progress
    from muscle_bayes.report.discovery_figures import write_figures
    from muscle_bayes.report.discovery_summary import summary

    compute_on(device)
    loaded = read_runs(runs)
    console = Console(emoji=False)
    held = tuple(hold_out or ())
    with shown_progress() as report:
        found = search(
            loaded,
            hold_out=held,
            friction=friction,
            effects=tuple(effect or ()),
            seed=seed,
            report=report,
            told=lambda text: console.print(text, soft_wrap=True),
            budget=budget,
            smallest=smallest,
        )
    origins = {run.name: run.metadata.origin for run in loaded}
    write_figures(found, out, origins)
    (out / "summary.md").write_text(summary(found, origins), encoding="utf-8")
    if found.next_experiment is not None and found.next_experiment.sequence:
        (out / "next-experiment.toml").write_text(found.next_experiment.sequence, encoding="utf-8")
    write_json(out / "discovery.json", found.as_dict())
    write_json(json, found.as_dict())
    _show(console, found, out)
    with shown_progress() as report:
        posterior = fit(
            seen_parts(loaded, held),
            friction,
            found.effects,
            effort=EFFORTS[preset],
            seed=seed,
            report=report,
        )
    posterior.save(out / "posterior.nc")
    if not posterior.converged:
        reasons = "; ".join(posterior.complaints)
        console.print(f"revised model NOT CONVERGED: {reasons}", style="bold red")
        raise typer.Exit(EXIT_FAILED)


def _show(console, found: "Discovery", out: Path) -> None:
    """Verdict, probabilities and what was added, as tables."""
    from muscle_bayes.report.discovery_summary import verdict_text
    from muscle_bayes.report.tables import added, probabilities, shown

    told = found.as_dict()
    console.print(shown(probabilities(told)))
    for step in told["steps"]:
        console.print(f"added: {step['added']}", shown(added(step, found.floor)), sep="\n")
    console.print(verdict_text(found), style="bold")
    if found.next_experiment is not None:
        console.print(str(found.next_experiment), soft_wrap=True)
    for left_out in found.not_searched:
        console.print(f"not searched: {left_out}", style="bold yellow", soft_wrap=True)
    console.print(f"{found.stopped_because}; summary and figures: {out}", soft_wrap=True)
