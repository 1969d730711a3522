"""`muscle-bayes study`: everything from the runs to the report."""

from pathlib import Path
from typing import Annotated

import typer

from muscle_bayes.cli.common import JsonOption, SeedOption, write_json
from muscle_bayes.cli.device import Device, DeviceOption, compute_on
from muscle_bayes.cli.fit import EXIT_NOT_CONVERGED, Preset


def study(
    runs: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder of spring, staircase and sawtooth runs.")
    ] = Path("data"),
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the report goes.")] = Path(
        "reports"
    ),
    preset: Annotated[Preset, typer.Option(help="How long to sample.")] = Preset.full,
    device: DeviceOption = Device.cpu,
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """Fit fixture and muscle, check the sawtooth, draw figures and write reports/summary.md.

    Only what changed is run again, so an interrupted study goes on where it stopped.
    """
    from rich.console import Console

    from muscle_bayes.cli.progress import fit_progress
    from muscle_bayes.study.pipeline import Study, results, stages, unconverged

    compute_on(device)
    console = Console()
    work = Study.of(runs, out, preset.value, seed, fit_progress)
    for stage in stages(work):
        made = stage.run()
        console.print(f"{stage.name}: {'done' if made else 'unchanged'} ({stage.result})")
    if json is not None:
        write_json(json, results(work))
    console.print(f"read {out / 'summary.md'}")
    for name, complaints in unconverged(work).items():
        console.print(f"{name} NOT CONVERGED: " + "; ".join(complaints), style="bold red")
    if unconverged(work):
        raise typer.Exit(EXIT_NOT_CONVERGED)
