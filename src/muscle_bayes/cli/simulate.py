"""`muscle-bayes simulate`: synthetic runs with a known truth."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from muscle_bayes.cli.common import (
    FolderOption,
    JsonOption,
    SeedOption,
    option,
    writable_file,
    write_json,
)
from muscle_bayes.errors import MuscleBayesError

if TYPE_CHECKING:
    from muscle_bayes.twin import Rig, SimulatedRun

ProtocolArgument = Literal["spring", "staircase", "sawtooth", "free", "shipped"]


def simulate(
    protocol: Annotated[
        ProtocolArgument,
        typer.Argument(
            help="spring: reference spring, weights released. staircase: setpoint in steps, a run "
            "per load. sawtooth: fast cycles, load poured on in between. free: see --stages. "
            "shipped: the set in data/, which takes no option but --out and --json.",
        ),
    ],
    out: FolderOption,
    name: Annotated[
        str | None, option("NAME", "Name of the run; NAME-1, NAME-2, ... if there are more.")
    ] = None,
    mass: Annotated[
        list[float] | None, option("KG", "Load in kg; repeat it for more runs or pours.")
    ] = None,
    friction: Annotated[
        Literal["coulomb", "linear"] | None,
        typer.Option(help="Friction law, with J and D of Table 1; coulomb unless said."),
    ] = None,
    effect: Annotated[
        list[str] | None,
        option(
            "NAME[:PARAM=VALUE,...]",
            "Hidden effect, e.g. coil-contact:stiffness=150,onset=0.02; repeatable. "
            "`muscle-bayes effects` lists them.",
        ),
    ] = None,
    rig: Annotated[
        Path | None,
        option(
            "RIG.toml",
            "What differs from the default rig: tables fixture, element_a, truth, "
            "truth.muscle_a, effects.NAME and so on.",
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        option(
            "PARAM=VALUE",
            "One value of the rig, e.g. J=0.0013, muscle_a.K_hyst=400, "
            "element_a.heater_length=0.075; repeatable, comes after --rig.",
            "--set",
        ),
    ] = None,
    stages: Annotated[
        Path | None,
        option(
            "FILE",
            "Protocol free, as TOML: load, initial_angle and an array of tables named stage, "
            "each with setpoint_a, setpoint_b, duration, wait, load, pour_time.",
        ),
    ] = None,
    log_period: Annotated[
        float | None, option("S", "Time aimed at between rows, s; 0.03 unless said.")
    ] = None,
    seed: SeedOption = 0,
    truth: Annotated[
        Path | None,
        option("FILE", "True parameters; DIR/truth.toml unless said.", callback=writable_file),
    ] = None,
    json: JsonOption = None,
) -> None:
    """Write synthetic runs and, in a file of its own, the truth behind them.

    The simulator shares no model or integration code with the inference. Equal options and seed
    write equal bytes. A measured run is never replaced.

    Examples:
        muscle-bayes simulate spring --out runs
        muscle-bayes simulate sawtooth --effect coil-contact:stiffness=150,onset=0.02 --out runs
    """
    from muscle_bayes.progress import shares, shown_progress
    from muscle_bayes.twin import simulate as simulate_run
    from muscle_bayes.twin.plans import plan_runs
    from muscle_bayes.twin.shipped import write_shipped
    from muscle_bayes.twin.storage import TRUTH_FILE, check_free, save_runs

    target = truth or out / TRUTH_FILE
    if protocol == "shipped":
        given = (name, mass, friction, effect, rig, settings, stages, log_period, truth)
        if seed != 0 or any(value is not None and value != [] for value in given):
            raise MuscleBayesError("shipped: the set is fixed. Fix: give --out and --json only.")
        with shown_progress() as report:
            runs = write_shipped(out, lambda name, share: shares(report, name)(share))
    else:
        built = _rig(protocol, friction, effect or [], rig, settings or [])
        plan = plan_runs(
            protocol,
            built,
            mass or [],
            name=name,
            stages=stages,
            log_period=log_period,
        )
        check_free(out, list(plan))
        with shown_progress() as report:
            runs = {
                name: simulate_run(built, protocol, (seed, number), shares(report, name))
                for number, (name, protocol) in enumerate(plan.items())
            }
        save_runs(out, runs, truth)
    _report(runs, out, target, seed, json)


def _rig(
    protocol: str, friction: str | None, effects: list[str], path: Path | None, settings: list[str]
) -> "Rig":
    from dataclasses import replace

    from muscle_bayes.twin import COULOMB_TABLE_1, LINEAR_TABLE_1, Rig, parse_effect, spring_rig
    from muscle_bayes.twin.overrides import override, parse_setting, read_rig

    rig = spring_rig(Rig()) if protocol == "spring" else Rig()
    if friction is not None:
        inertia, damping = LINEAR_TABLE_1 if friction == "linear" else COULOMB_TABLE_1
        law = {"truth.friction_law": friction, "truth.J": inertia, "truth.D": damping}
        rig = override(rig, law)
    if path is not None:
        rig = read_rig(path, rig)
    rig = override(rig, dict(map(parse_setting, settings)))
    hidden = (*rig.truth.effects, *map(parse_effect, effects))
    return replace(rig, truth=replace(rig.truth, effects=hidden))


def _report(
    runs: "dict[str, SimulatedRun]", out: Path, truth: Path, seed: int, json: Path | None
) -> None:
    told = []
    for name, run in runs.items():
        rows, seconds = len(run.log), float(run.log.iloc[:, 0].max())
        path = out / f"{name}.csv"
        typer.echo(f"{path}: synthetic {run.metadata.protocol}, {rows} rows, {seconds:.1f} s")
        told.append(
            {
                "name": name,
                "path": path,
                "protocol": run.metadata.protocol,
                "rows": rows,
                "duration": seconds,
                "truth": run.truth,
            }
        )
    typer.echo(f"{truth}: the truth behind them, for judging only")
    write_json(json, {"origin": "synthetic", "seed": seed, "truth_file": truth, "runs": told})
