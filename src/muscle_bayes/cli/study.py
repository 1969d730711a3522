"""`muscle-bayes study`: everything from the runs to the report."""

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from muscle_bayes.cli.common import (
    EXIT_FAILED,
    Device,
    DeviceOption,
    FolderOption,
    JsonOption,
    compute_on,
    option,
    write_json,
)
from muscle_bayes.cli.fit import Preset

if TYPE_CHECKING:
    from muscle_bayes.study.plan import Plan

CONFIG = "study.toml"
"""Settings that lie beside the runs."""


def study(
    runs: Annotated[Path, option("DIR", "Folder of runs.")] = Path("data"),
    config: Annotated[
        Path | None,
        option("STUDY.toml", "What to do with them.  [default: DIR/study.toml where there is one]"),
    ] = None,
    out: FolderOption = Path("reports"),
    preset: Annotated[Preset, typer.Option(help="How long to compute.")] = "full",
    device: DeviceOption = "cpu",
    json: JsonOption = None,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="Seed of the random numbers.  [default: STUDY.toml's, or 0]"),
    ] = None,
) -> None:
    """Fit fixture and muscle, check, discover, tune gains, and write report.html and report.pdf.

    Only what changed is run again, so an interrupted study goes on where it stopped. Exits with 1 if
    chains have not converged, unless a revised fit replaces theirs.

    Examples:
        muscle-bayes study --preset quick
        muscle-bayes study --runs myruns --out myreport
    """
    from rich.console import Console

    from muscle_bayes.cli.study_progress import progress
    from muscle_bayes.study.pipeline import run_stages
    from muscle_bayes.study.stages import all_stages

    if device != "cpu":
        compute_on(device)
    plan = _plan(runs, config, out, preset, device, seed)
    stages, left_out = all_stages(plan)
    console = Console(emoji=False)
    for one in left_out:
        console.print(f"{one.name} does not apply: {one.why}", markup=False, highlight=False)
    with progress(plan, stages) as watcher:
        run_stages(plan, stages, watcher)
    summary = plan.summary()
    write_json(json, summary)
    console.print(f"read {out / 'report.html'} or {out / 'report.pdf'}", soft_wrap=True)
    complaints, replaced = summary["not_converged"], summary["replaced"]
    for name, reasons in complaints.items():
        which = f"{name}, replaced by revised," if name in replaced else name
        console.print(f"{which} NOT CONVERGED: " + "; ".join(reasons), style="bold red")
    if complaints.keys() - replaced:
        raise typer.Exit(EXIT_FAILED)


def _plan(
    runs: Path, config: Path | None, out: Path, preset: Preset, device: Device, seed: int | None
) -> "Plan":
    from muscle_bayes.study.config import StudyConfig, read_config
    from muscle_bayes.study.plan import Plan, available

    if config is None and (runs / CONFIG).is_file():
        config = runs / CONFIG
    told = StudyConfig() if config is None else read_config(config)
    told = told if seed is None else told.model_copy(update={"seed": seed})
    beside = Path() if config is None else config.parent
    again = ["muscle-bayes", "study", "--runs", str(runs)]
    again += ["--config", str(config)] if config is not None else []
    again += ["--preset", preset, "--seed", str(told.seed), "--out", str(out)]
    return Plan.of(
        runs,
        out,
        preset,
        told,
        str(runs if config is None else config),
        joint=None if told.joint is None else beside / told.joint,
        device=device,
        started_as=shlex.join(again),
        calibrations=available(
            [out / "calibration", out, *(beside / one for one in told.evidence)],
            out / "results",
        ),
    )
