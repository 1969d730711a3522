"""`muscle-bayes tune`: gains for joints that have not been built yet."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from muscle_bayes.cli.common import (
    JsonOption,
    SeedOption,
    option,
    writable_file,
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
from muscle_bayes.whole_file import write_whole


class LawChoice(StrEnum):
    """Laws that can be tuned."""

    pi = "pi"
    two_degrees = "two-degrees"
    feedforward = "feedforward"
    cascade = "cascade"


def tune(
    muscle: PosteriorArgument,
    out: Annotated[Path, option("GAINS.toml", "Where the gains go.", callback=writable_file)],
    law: Annotated[
        list[LawChoice] | None,
        typer.Option(
            help="Only this control law; repeatable. Default: all, and one is recommended."
        ),
    ] = None,
    spec: SpecOption = None,
    header: Annotated[
        Path | None, option("GAINS.h", "Also write the firmware's header.", callback=writable_file)
    ] = None,
    report: Annotated[
        Path | None, option("DIR", "Also write tables and figures there.", callback=writable_folder)
    ] = None,
    heater: HeaterOption = None,
    fixture: FixtureOption = None,
    joint: JointOption = None,
    scenario: ScenarioOption = None,
    period_ms: Annotated[int, typer.Option(min=1, max=1000, help="Control period.")] = 30,
    draws: Annotated[int, typer.Option(min=4, help="Joints to tune on.")] = 96,
    judged: Annotated[int, typer.Option(min=4, help="New joints to judge on.")] = 400,
    starts: Annotated[int, typer.Option(min=1, help="Points of the global search.")] = 64,
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """Tune gains over muscles that have not been built yet, and judge them on other new joints.

    What the best input could do is computed first; what is out of its reach is reported and not tuned
    for. Exits with 0 however few joints meet the specifications: look at the table.

    Examples:
        muscle-bayes tune muscle.nc --out gains.toml --report reports/control
        muscle-bayes tune population.nc --law pi --spec settling_time=20 --out gains.toml
    """
    from rich.console import Console

    from muscle_bayes.control.laws.gains import gains_header, gains_toml
    from muscle_bayes.control.study import tuned_laws
    from muscle_bayes.control.tune import Effort
    from muscle_bayes.progress import shown_progress
    from muscle_bayes.report.control_page import write_control_report

    limits, scenarios = chosen_limits(spec), chosen_scenarios(scenario, period_ms / 1000.0)
    joints, notes = load_joints(muscle, heater, fixture, joint, draws + judged, seed)
    with shown_progress() as progress:
        found = tuned_laws(
            joints,
            draws,
            scenarios,
            laws=[one.value for one in law or LawChoice],
            limits=limits,
            effort=Effort(starts=starts),
            period_ms=period_ms,
            notes=notes,
            seed=seed,
            report=progress,
        )
    result, chosen = found.judgement, found.judgement.recommended
    head = f"{result.sentence()}\n" + "\n".join(result.notes)
    write_whole(out, gains_toml(result.gains[chosen], head).encode())
    if header is not None:
        write_whole(header, gains_header(result.gains[chosen], joints.design, head).encode())
    if report is not None:
        write_control_report(result, found.bank, report, edges=found.edges)
        typer.echo(f"report: {report / 'report.md'}")
    show(Console(), result, found.edges)
    typer.echo(f"gains: {out}")
    write_json(json, result.as_dict() | {"edges": found.edges, "seed": seed})


def show(console, result, edges) -> None:
    """Probabilities, what is infeasible, edges and the recommendation."""
    from muscle_bayes.report.control_page import probabilities
    from muscle_bayes.report.tables import shown

    console.print(shown(probabilities(result)))
    lines = [f"{k}: infeasible, {v.infeasible}" for k, v in result.specs.items() if v.infeasible]
    lines += [
        f"{law}: at the edge of the search: {', '.join(at)}" for law, at in edges.items() if at
    ]
    for line in (*lines, *result.notes, result.sentence()):
        console.print(line, markup=False, highlight=False)
