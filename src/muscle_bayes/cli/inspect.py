"""`muscle-bayes inspect`: what a run holds, what was repaired in it, what it assumes."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from muscle_bayes.cli.common import (
    EXIT_USER_ERROR,
    JsonOption,
    RunsArgument,
    option,
    print_error,
    writable_file,
    writable_folder,
    write_json,
)
from muscle_bayes.errors import MuscleBayesError

if TYPE_CHECKING:
    from rich.console import Console

    from muscle_bayes.data import Run

_FIGURES = Path("reports/inspect")


def inspect(
    runs: RunsArgument,
    json: JsonOption = None,
    figure: Annotated[
        Path | None, option("FIGURE.png", "Figure of the one run.", callback=writable_file)
    ] = None,
    out: Annotated[
        Path | None,
        option(
            "DIR",
            f"Folder of the figures, NAME.png.  [default: {_FIGURES}]",
            callback=writable_folder,
        ),
    ] = None,
) -> None:
    """Show what runs hold, what was repaired in them and what they assume, and draw them.

    Examples:
        muscle-bayes inspect data/sawtooth.csv
        muscle-bayes inspect data --out reports/inspect --json runs.json
    """
    from rich.console import Console

    from muscle_bayes.data import find_runs

    logs = find_runs(runs)
    _check_figure(figure, out, len(logs))
    console = Console()
    described: list[dict[str, Any]] = []
    failed: list[dict[str, Any]] = []
    for log in logs:
        target = figure or (out or _FIGURES) / f"{log.stem}.png"
        try:
            described.append(_inspect_one(log, target, console))
        except MuscleBayesError as error:
            print_error(error)
            failed.append({"path": log, "error": str(error)})
    write_json(json, {"runs": described, "failed": failed})
    if failed:
        raise typer.Exit(EXIT_USER_ERROR)


def _check_figure(figure: Path | None, out: Path | None, runs: int) -> None:
    if figure is not None and (out is not None or runs > 1):
        why = f"{runs} runs need a figure each" if runs > 1 else "given together with --out"
        raise MuscleBayesError(f"--figure {figure}: {why}. Fix: give --out DIR alone.")


def _inspect_one(log: Path, target: Path, console: "Console") -> dict[str, Any]:
    from dataclasses import asdict

    from muscle_bayes.data import assumptions, read_run, recording_of
    from muscle_bayes.report.run_figure import run_figure
    from muscle_bayes.report.run_summary import summarise
    from muscle_bayes.report.style import save

    run = read_run(log)
    assumed = [(one.key, one.taken) for one in assumptions(run)]
    summary = summarise(run)
    _print(run, summary, assumed, console)
    save(run_figure(run), target)
    console.print(f"figure: {target}\n", soft_wrap=True, markup=False, highlight=False)
    made = recording_of(log)
    return summary | {
        "assumed": [{"key": key, "taken": taken} for key, taken in assumed],
        "figure": target,
        "recording": None if made is None else asdict(made),
    }


def _print(
    run: "Run", summary: dict[str, Any], assumed: list[tuple[str, str]], console: "Console"
) -> None:
    from rich.table import Table
    from rich.text import Text

    from muscle_bayes.data import recording_of
    from muscle_bayes.report.run_summary import summary_lines

    table = Table(title=Text(run.name), show_header=False, title_justify="left", title_style="bold")
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    if run.path is not None and (made := recording_of(run.path)) is not None:
        loud_style = "" if made.complete else "bold reverse yellow"
        table.add_row("recording", Text(str(made), style=loud_style))
    for label, told in summary_lines(summary):
        loud = label == "origin" and run.metadata.origin == "synthetic"
        table.add_row(label, Text(told, style="bold reverse yellow" if loud else ""))
    if assumed:
        table.add_row("assumed", Text("\n".join(f"{key}: {taken}" for key, taken in assumed)))
    console.print(table)
