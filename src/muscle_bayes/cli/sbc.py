"""`muscle-bayes sbc`: are the posteriors of these runs' kind calibrated?"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from muscle_bayes.cli.common import (
    EXIT_FAILED,
    FolderOption,
    JsonOption,
    SchedulerOption,
    SeedOption,
    WorkersOption,
    write_json,
)
from muscle_bayes.cli.fit import EffectOption, FrictionOption, GivenOption

if TYPE_CHECKING:
    from muscle_bayes.criticism.replicates import Template

LEAST_CHANCE = 0.01


def _measured(template: "Template", seed: int, out: Path) -> dict[str, Any]:
    """Draws from the posterior of the runs as measured, and how it was solved."""
    from muscle_bayes.criticism.sbc import measured_task
    from muscle_bayes.errors import MuscleBayesError
    from muscle_bayes.parallel.tasks import run_tasks

    (found,) = run_tasks(measured_task(template, seed), out / "sets", workers=1).values()
    if not found["converged"]:
        raise MuscleBayesError(
            "the posterior of the runs as measured did not converge, so no parameters can be drawn "
            "from it. Fix: see `muscle-bayes fit` on these runs, or try another --seed."
        )
    return found


def sbc(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...",
            help="Runs that give rig, drive and times; their readings are redrawn.",
        ),
    ],
    out: FolderOption = Path("reports/sbc"),
    sets: Annotated[int, typer.Option(min=20, help="Number of data sets.")] = 200,
    friction: FrictionOption = "coulomb",
    effect: EffectOption = None,
    given: GivenOption = None,
    measured: Annotated[
        bool,
        typer.Option(
            "--measured",
            help="Draw parameters from the posterior of the runs as measured, not from the prior. "
            "Rank them in the posterior of these and redrawn readings together.",
        ),
    ] = False,
    scheduler: SchedulerOption = None,
    workers: WorkersOption = 2,
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """Simulation-based calibration: fit data sets drawn from prior and likelihood.

    The true value must rank uniformly among the draws of its posterior, in every quantity. Chi-square
    and Kolmogorov-Smirnov tests check that, corrected by Bonferroni. Data sets whose readings hardly
    move are drawn again: they carry no information. Finished data sets stay in DIR, so interrupted
    work goes on where it stopped. Exits with 1 if ranks are not uniform (p below 0.01).

    Examples:
        muscle-bayes sbc data/spring-*.csv --sets 100 --out reports/sbc
        muscle-bayes sbc data/staircase-*.csv --given fixture.nc --measured --out reports/sbc
    """
    from rich.console import Console

    from muscle_bayes.criticism.replicates import Template
    from muscle_bayes.criticism.sbc import Calibration, calibration_tasks
    from muscle_bayes.parallel.tasks import run_tasks
    from muscle_bayes.progress import shown_progress
    from muscle_bayes.report.calibration_figure import calibration_figure
    from muscle_bayes.report.style import save

    paths = tuple(path.resolve() for path in runs)
    fixture = None if given is None else given.resolve()
    template = Template(paths, friction, tuple(effect or ()), fixture)
    with shown_progress() as report:
        known = _measured(template, seed, out) if measured else None
        results = run_tasks(
            calibration_tasks(template, sets, seed, known),
            out / "sets",
            address=scheduler,
            workers=workers,
            report=lambda done, total: report("data sets", done, total),
        )
    source = "the posterior of the runs as measured" if measured else "the prior"
    calibration = Calibration.of(list(results.values()), source)
    save(calibration_figure(calibration, out.name), out / "ranks.png")
    numbers = calibration.as_dict()
    write_json(out / "calibration.json", numbers)
    write_json(json, numbers)
    name, chance = calibration.smallest()
    console = Console()
    console.print(
        f"{calibration.sets} data sets, {calibration.converged} converged; least uniform: {name}, "
        f"p = {chance:.3g} after correction ({out / 'ranks.png'})"
    )
    if chance < LEAST_CHANCE:
        console.print("ranks are NOT uniform", style="bold red")
        raise typer.Exit(EXIT_FAILED)
