"""`muscle-bayes robustness`: what gains do to joints that have not been built yet."""

from pathlib import Path
from typing import Annotated

import typer

from muscle_bayes.cli.common import (
    JsonOption,
    SeedOption,
    option,
    writable_folder,
    write_json,
)
from muscle_bayes.cli.control_options import (
    FixtureOption,
    HeaterOption,
    JointOption,
    PosteriorArgument,
    ScenarioOption,
    SpecOption,
    chosen_limits,
    chosen_scenarios,
    load_joints,
)
from muscle_bayes.cli.tune import show
from muscle_bayes.errors import MuscleBayesError


def robustness(
    muscle: PosteriorArgument,
    out: Annotated[Path, option("DIR", "Folder of the report.", callback=writable_folder)],
    gains: Annotated[
        list[Path] | None,
        option("GAINS.toml", "Gains of `tune`; repeatable. Default: the thesis'."),
    ] = None,
    spec: SpecOption = None,
    heater: HeaterOption = None,
    fixture: FixtureOption = None,
    joint: JointOption = None,
    scenario: ScenarioOption = None,
    draws: Annotated[int, typer.Option(min=4, help="Number of joints.")] = 1000,
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """Simulate the closed loop of new joints in every scenario, beside gains by the thesis' method.

    Writes report.md with tables and figures. Exits with 0 however poor the gains are.

    Examples:
        muscle-bayes robustness muscle.nc --gains gains.toml --out reports/robustness
        muscle-bayes robustness population.nc --scenario step --out reports/robustness
    """
    from rich.console import Console

    from muscle_bayes.control.batch import Bank
    from muscle_bayes.control.closed_loop import Clock
    from muscle_bayes.control.judging.judge import judge
    from muscle_bayes.control.laws.gains import read_gains
    from muscle_bayes.control.linear import snapshot_gains
    from muscle_bayes.control.scenarios.thesis import STEP
    from muscle_bayes.control.study import asked
    from muscle_bayes.progress import shown_progress
    from muscle_bayes.report.control_page import write_control_report

    given = {path.stem: read_gains(path) for path in gains or ()}
    periods = {one.period_ms for one in given.values()} or {30}
    if len(periods) > 1:
        raise MuscleBayesError("--gains: have different periods. Fix: judge them one at a time")
    period_ms = periods.pop()
    limits, scenarios = chosen_limits(spec), chosen_scenarios(scenario, period_ms / 1000.0)
    joints, notes = load_joints(muscle, heater, fixture, joint, draws, seed)
    laws = given | {"thesis": snapshot_gains(joints, STEP, period_ms=period_ms)}
    bank = Bank(joints, Clock(period_ms / 1000.0), seed)
    with shown_progress() as progress:
        specs = asked(joints, scenarios, limits, period_ms / 1000.0, progress)
        result = judge(bank, laws, scenarios, specs, notes=notes, report=progress)
    write_control_report(result, bank, out, command="muscle-bayes robustness")
    show(Console(), result, {})
    typer.echo(f"report: {out / 'report.md'}")
    write_json(json, result.as_dict() | {"seed": seed})
