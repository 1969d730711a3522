"""`muscle-bayes tune`: gains for every joint that a posterior thinks possible."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from muscle_bayes.cli.common import JsonOption, SeedOption, print_place, writable_file, write_json
from muscle_bayes.cli.control_options import (
    FixtureOption,
    HeaterOption,
    JointOption,
    PosteriorArgument,
    load_joints,
)
from muscle_bayes.cli.device import Device, DeviceOption, compute_on
from muscle_bayes.errors import MuscleBayesError, did_you_mean
from muscle_bayes.whole_file import write_whole

if TYPE_CHECKING:
    from muscle_bayes.control.criteria import Criterion
    from muscle_bayes.control.scenario import Scenario


class CriterionChoice(StrEnum):
    """What is made small."""

    mean = "mean"
    cvar = "cvar"
    probability = "probability"


class LawChoice(StrEnum):
    """Laws that can be tuned."""

    pi = "pi"
    antiwindup = "pi-antiwindup"
    feedforward = "pi-feedforward"
    cascade = "cascade"


def tune(
    posterior: PosteriorArgument,
    out: Annotated[
        Path, typer.Option(metavar="GAINS.toml", callback=writable_file, help="Where the gains go.")
    ],
    criterion: Annotated[CriterionChoice, typer.Option(help="What is made small.")] = (
        CriterionChoice.cvar
    ),
    spec: Annotated[
        list[str] | None,
        typer.Option(metavar="METRIC=LIMIT", help="For probability: at most this; repeatable."),
    ] = None,
    law: Annotated[LawChoice, typer.Option(help="Control law.")] = LawChoice.antiwindup,
    header: Annotated[
        Path | None,
        typer.Option(
            metavar="GAINS.h", callback=writable_file, help="Also write the firmware's header."
        ),
    ] = None,
    heater: HeaterOption = None,
    fixture: FixtureOption = None,
    joint: JointOption = None,
    scenario: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Only these scenarios, a file's or by name; repeatable."),
    ] = None,
    period_ms: Annotated[int, typer.Option(min=1, max=1000, help="Control period.")] = 30,
    draws: Annotated[int, typer.Option(min=4, help="Joints to tune on; as many are kept.")] = 64,
    starts: Annotated[int, typer.Option(min=1, help="Points of the global search.")] = 32,
    json: JsonOption = None,
    device: DeviceOption = Device.cpu,
    seed: SeedOption = 0,
) -> None:
    """Tune gains over the posterior's draws, and test them on draws that were not used.

    Examples:
        muscle-bayes tune muscle.nc --out gains.toml
        muscle-bayes tune muscle.nc --criterion probability --spec tracking_error=0.02 --out g.toml
    """
    from rich.console import Console

    from muscle_bayes.control.batch import Bank
    from muscle_bayes.control.closed_loop import Clock
    from muscle_bayes.control.feedforward import feedforward_of
    from muscle_bayes.control.gains import Gains, gains_toml
    from muscle_bayes.control.header import EXPORTED, gains_header, on_the_bench
    from muscle_bayes.control.study import robustness
    from muscle_bayes.control.tune import Effort
    from muscle_bayes.control.tune import tune as tune_gains
    from muscle_bayes.progress import shown_progress

    compute_on(device)
    wanted = _criterion(criterion, spec or [])
    if header is not None and law.value not in EXPORTED:
        raise MuscleBayesError(
            f"--header: law {law.value!r} does not run on the firmware. Fix: use --law pi-antiwindup"
        )
    joints, notes = load_joints(posterior, heater, fixture, joint, 2 * draws, seed)
    tuned_on, kept = joints.split(draws)
    courses = _scenarios(scenario or [], period_ms / 1000.0)
    table = feedforward_of(tuned_on) if law is LawChoice.feedforward else None
    blank = Gains(
        law=law.value, period_ms=period_ms, proportional=1.0, integral=1.0, feedforward=table
    )
    clock = Clock(blank.period)
    with shown_progress() as report:
        found = tune_gains(
            Bank(tuned_on, clock, seed),
            courses,
            wanted,
            blank,
            effort=Effort(starts=starts),
            seed=seed,
            report=report,
        )
        exported = law.value in EXPORTED
        gains = on_the_bench(found.gains, joints.design) if exported else found.gains
        result = robustness(Bank(kept, clock, seed + 1), gains, courses, notes=notes)
    head = (
        f"{found.criterion} over {draws} draws of {posterior.name}, "
        f"mean of {len(courses)} scenarios: {found.value:.5g}\n" + "\n".join(notes)
    )
    write_whole(out, gains_toml(gains, head).encode())
    if header is not None:
        write_whole(header, gains_header(gains, joints.design, head).encode())
    console = Console()
    console.print(
        f"{gains.law}: {gains.proportional:.5g} per rad, {gains.integral:.5g} per rad s, "
        f"bias {gains.bias:.3g}; {found.criterion} {found.value:.4g}, "
        f"{found.evaluations} evaluations"
    )
    for name, rows in result.summary().items():
        cost = rows["cost"]
        console.print(
            f"{name}: on draws kept apart cost {cost['median']:.3f}, CVaR {cost['cvar95']:.3f}, "
            f"unstable {rows['unstable']['probability']:.0%}"
        )
    for note in notes:
        console.print(note, markup=False, highlight=False)
    print_place("gains", out)
    if json is not None:
        write_json(
            json,
            {
                "criterion": found.criterion,
                "value": found.value,
                "evaluations": found.evaluations,
                "kept_apart": result.as_dict(),
                "seed": seed,
            },
        )


def _criterion(choice: CriterionChoice, spec: list[str]) -> "Criterion":
    from muscle_bayes.control.criteria import JUDGED, CVaR, MeanCost, Shortfall

    if (choice is CriterionChoice.probability) != bool(spec):
        raise MuscleBayesError(
            "--criterion probability and --spec belong together. Fix: give limits such as "
            "--spec tracking_error=0.02"
        )
    if choice is not CriterionChoice.probability:
        return MeanCost() if choice is CriterionChoice.mean else CVaR()
    limits = []
    for text in spec:
        name, _, number = text.partition("=")
        try:
            limit = float(number)
        except ValueError:
            limit = -1.0
        if name not in JUDGED or not 0.0 < limit < float("inf"):
            raise MuscleBayesError(
                f"--spec {text}: is no METRIC=LIMIT. Fix: use one of {', '.join(JUDGED)} and a "
                "positive number, in rad, 1, s or C"
            )
        limits.append((name, limit))
    return Shortfall(tuple(limits))


def _scenarios(names: list[str], period: float) -> "list[Scenario]":
    from muscle_bayes.control.scenario_file import read_scenario
    from muscle_bayes.control.scenarios import harder_scenarios, thesis_scenarios

    standard = list(thesis_scenarios(period))
    known = {one.name: one for one in (*standard, *harder_scenarios(period))}
    chosen = []
    for name in names:
        if name in known:
            chosen.append(known[name])
        elif name.endswith(".toml"):
            chosen.append(read_scenario(Path(name), period))
        else:
            raise MuscleBayesError(
                f"--scenario {name}: is not known.{did_you_mean(name, known)} Fix: use a file, or "
                f"one of {', '.join(known)}."
            )
    return chosen or standard
