"""`python -m benchmarks.trial`: how often does discovery find what was hidden?"""

from pathlib import Path
from typing import Annotated, Any

import typer

from muscle_bayes.cli.common import (
    FolderOption,
    JsonOption,
    SchedulerOption,
    SeedOption,
    WorkersOption,
    user_errors,
    write_json,
)
from muscle_bayes.compiled import keep_compiled_code


def trial(
    out: FolderOption = Path("reports/trial"),
    single: Annotated[int, typer.Option(min=0, help="Cases with one effect hidden.")] = 60,
    none: Annotated[int, typer.Option(min=0, help="Cases with nothing hidden.")] = 60,
    outside: Annotated[int, typer.Option(min=0, help="Cases outside the catalogue.")] = 30,
    pair: Annotated[int, typer.Option(min=0, help="Cases with two effects hidden.")] = 30,
    scheduler: SchedulerOption = None,
    workers: WorkersOption = 2,
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """Hide effects in synthetic runs of random rigs, search for them blind, and count the hits.

    Half of the rigs are like the thesis', the others are pendulums, sprung discs and driven axes. Rigs,
    true parameters, strengths and noise differ from case to case. Every finished case is kept
    in DIR, so interrupted work goes on where it stopped. All
    outcomes end in one file, outcomes.json. Workers of a scheduler run in the project's folder.

    Examples:
        python -m benchmarks.trial --out reports/trial
        python -m benchmarks.trial --single 4 --none 4 --outside 0 --pair 0 --workers 2
    """
    from rich.console import Console
    from rich.table import Table

    from benchmarks.trial.cases import cases
    from benchmarks.trial.outcome import trial_tasks
    from muscle_bayes.errors import MuscleBayesError
    from muscle_bayes.parallel.tasks import run_tasks
    from muscle_bayes.progress import shown_progress

    wanted = {"single": single, "none": none, "outside": outside, "pair": pair}
    chosen = [one for kind, count in wanted.items() for one in cases(kind, count, seed)]  # type: ignore[arg-type]
    if not chosen:
        raise MuscleBayesError("no case was asked for. Fix: ask for at least one of any kind.")
    tasks = trial_tasks(chosen)
    with shown_progress() as report:
        results = run_tasks(
            tasks,
            out / "cases",
            address=scheduler,
            workers=workers,
            report=lambda done, total: report("cases", done, total),
        )
    outcomes = list(results.values())
    numbers = write_counts(out, {tasks.stamp: len(outcomes)}, outcomes)
    if json is not None:
        write_json(json, {**numbers, "outcomes": outcomes})
    console = Console()
    table = Table("claim", "wanted", "found", "95 % interval")
    for one in numbers["rates"]:
        found = f"{one['hits']} of {one['cases']}"
        table.add_row(one["what"], one["wanted"], found, f"{one['low']:.0%} to {one['high']:.0%}")
    console.print(table)
    matrix = Table("hidden", "said first")
    for hidden, said in numbers["confusion"].items():
        matrix.add_row(hidden, ", ".join(f"{name} {n}" for name, n in said.items()))
    console.print(matrix)
    console.print(f"expected calibration error {numbers['calibration_error']:.3f}; {out}")


def write_counts(
    folder: Path, codes: dict[str, int], outcomes: list[dict[str, Any]]
) -> dict[str, Any]:
    """Numbers and figure of `outcomes`, and these themselves, into `folder`.

    `codes`: how many of them the code of each stamp has searched.
    """
    from benchmarks.trial.counts import counted
    from benchmarks.trial.power import power_figure
    from muscle_bayes.report.style import save
    from muscle_bayes.report.trial_figure import trial_figure

    numbers = {"codes": codes, **counted(outcomes)}
    write_json(folder / "trial.json", numbers)
    write_json(folder / "outcomes.json", {"outcomes": outcomes})
    save(trial_figure(numbers), folder / "trial.png")
    save(power_figure(numbers), folder / "trial-power.png")
    return numbers


if __name__ == "__main__":
    keep_compiled_code()
    typer.run(user_errors()(trial))
