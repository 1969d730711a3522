"""`muscle-bayes robustness`: what gains do to every joint that a posterior thinks possible."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from muscle_bayes.cli.common import FolderOption, JsonOption, SeedOption, print_place, write_json
from muscle_bayes.cli.control_options import (
    FixtureOption,
    HeaterOption,
    JointOption,
    PosteriorArgument,
    load_joints,
)
from muscle_bayes.cli.device import Device, DeviceOption, compute_on

if TYPE_CHECKING:
    from rich.console import Console

    from muscle_bayes.control.study import Robustness, RunawayCurve


def robustness(
    posterior: PosteriorArgument,
    out: FolderOption,
    gains: Annotated[
        Path | None,
        typer.Option(
            metavar="GAINS.toml", help="Default: PI by the thesis' method, on the mean joint."
        ),
    ] = None,
    heater: HeaterOption = None,
    fixture: FixtureOption = None,
    joint: JointOption = None,
    scenario: Annotated[
        list[Path] | None,
        typer.Option(metavar="SCENARIO.toml", help="One of your own as well; repeatable."),
    ] = None,
    without: Annotated[
        str | None, typer.Option(metavar="EFFECT", help="Leave this effect of the posterior out.")
    ] = None,
    draws: Annotated[int, typer.Option(min=2, help="Number of joints.")] = 1000,
    json: JsonOption = None,
    device: DeviceOption = Device.cpu,
    seed: SeedOption = 0,
) -> None:
    """Simulate the closed loop of an antagonistic joint for every draw and scenario.

    Writes a figure a scenario and one of runaway against the setpoint's frequency. Prints metrics
    with 90 % intervals over the draws. Exits with 0 however poor the gains are: look at the table.

    Examples:
        muscle-bayes robustness muscle.nc --gains gains.toml --out reports/robustness
        muscle-bayes robustness muscle.nc --draws 100 --out reports/robustness
    """
    from rich.console import Console

    from muscle_bayes.control.batch import Bank
    from muscle_bayes.control.closed_loop import Clock
    from muscle_bayes.control.gains import read_gains
    from muscle_bayes.control.linear import margins, snapshot_gains
    from muscle_bayes.control.scenario_file import read_scenario
    from muscle_bayes.control.scenarios import STEP, harder_scenarios, thesis_scenarios
    from muscle_bayes.control.study import robustness as robustness_of
    from muscle_bayes.control.study import runaway_curve
    from muscle_bayes.progress import shown_progress
    from muscle_bayes.report.control_figures import runaway_figure, scenario_figure
    from muscle_bayes.report.style import save

    compute_on(device)
    given = None if gains is None else read_gains(gains)
    joints, notes = load_joints(posterior, heater, fixture, joint, draws, seed)
    joints = joints if without is None else joints.without(without)
    chosen = given or snapshot_gains(joints, STEP)
    own = [read_scenario(path, chosen.period) for path in scenario or ()]
    courses = (*thesis_scenarios(chosen.period), *harder_scenarios(chosen.period), *own)
    bank = Bank(joints, Clock(chosen.period), seed)
    with shown_progress() as report:
        result = robustness_of(bank, chosen, courses, notes=notes, report=report)
        curve = runaway_curve(bank, chosen)
    told = [] if chosen.law == "cascade" else margins(joints, chosen, STEP)
    for one in courses:
        save(scenario_figure(result, one), out / f"{one.name}.png")
    save(runaway_figure(curve), out / "runaway.png")
    console = Console()
    _show(console, result, curve, told)
    print_place("figures", out)
    if json is not None:
        data: dict[str, Any] = result.as_dict() | {"runaway": curve.as_dict(), "seed": seed}
        write_json(json, data | {"margins": [one._asdict() for one in told]})


def _show(
    console: "Console", result: "Robustness", curve: "RunawayCurve", margins: list[Any]
) -> None:
    import numpy as np
    from rich.table import Table

    table = Table("scenario", "cost", "95 % CVaR", "RMS error [deg]", "peak [C]", "unstable", "hot")
    for name, rows in result.summary().items():
        error, peak = rows["tracking_error"], rows["peak_temperature"]
        table.add_row(
            name,
            f"{rows['cost']['median']:.3f}",
            f"{rows['cost']['cvar95']:.3f}",
            " to ".join(f"{np.degrees(error[key]):.2f}" for key in ("q05", "q95")),
            " to ".join(f"{peak[key]:.0f}" for key in ("q05", "q95")),
            f"{rows['unstable']['probability']:.0%}",
            f"{rows['unsafe']['probability']:.0%}",
        )
    console.print(table)
    numbers = result.gains
    console.print(
        f"{numbers.law}: {numbers.proportional:.5g} per rad, {numbers.integral:.5g} per rad s, "
        f"bias {numbers.bias:.3g}, every {numbers.period_ms} ms; {result.draws} draws"
    )
    if margins:
        phase = np.quantile([one.phase for one in margins], [0.05, 0.95])
        gain = np.quantile([one.gain for one in margins], [0.05, 0.95])
        console.print(
            f"margins of {len(margins)} draws, 90 %: phase {phase[0]:.0f} to {phase[1]:.0f} deg, "
            f"gain {gain[0]:.1f} to {gain[1]:.1f}"
        )
    away = np.maximum(curve.unstable, curve.unsafe)
    if (away > 0.5).any():
        first = curve.frequency[np.argmax(away > 0.5)]
        console.print(f"most draws run away, or get too hot, from {first:.3g} Hz on")
    for note in result.notes:
        console.print(note, markup=False, highlight=False)
