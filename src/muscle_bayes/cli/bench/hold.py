"""`muscle-bayes hold` and `muscle-bayes track`: the board's own controller at work, logged."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from muscle_bayes.cli.bench.bench_options import (
    MeterOption,
    PortOption,
    bench_lines,
    simulated_rig,
)
from muscle_bayes.cli.common import FolderOption, JsonOption, SeedOption, option, write_json
from muscle_bayes.errors import MuscleBayesError

if TYPE_CHECKING:
    from muscle_bayes.bench.simulation import SimulatedBench

GainsOption = Annotated[
    Path | None,
    option(
        "GAINS.toml",
        "Gains of `muscle-bayes tune`, compiled into the simulated board. A real board holds by those "
        "that it was flashed with.",
        "--gains",
    ),
]
JointOption = Annotated[
    Path | None,
    option("FILE", "Tables of the joint, as in NAME.toml; required with --real.", "--rig"),
]
RealOption = Annotated[
    bool, typer.Option("--real", help="Drive the real bench; without it, the firmware in simavr.")
]


def hold(
    angle: Annotated[float, option("RAD", "Angle to be held, rad.")],
    out: FolderOption,
    gains: GainsOption = None,
    duration: Annotated[float, option("S", "For how long, s.", min=1.0, max=3600.0)] = 60.0,
    real: RealOption = False,
    port: PortOption = None,
    meter: MeterOption = None,
    rig: JointOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
) -> None:
    """Have the heater board hold an angle by the gains compiled in, and log it as the run `hold`.

    Temperatures are reported to the board ten times a second; the heaters go off whatever ends it.

    Examples:
        muscle-bayes hold --angle 0.08 --gains gains.toml --out held
        muscle-bayes hold --angle 0.08 --duration 120 --real --rig joint.toml --out held
    """
    _drive(lambda time: angle, duration, "hold", out, gains, real, port, meter, rig, seed, json)


def track(
    scenario: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO", help="A scenario's name or SCENARIO.toml, as for `tune`."
        ),
    ],
    out: FolderOption,
    gains: GainsOption = None,
    duration: Annotated[float | None, option("S", "Only its first so many s.", min=1.0)] = None,
    real: RealOption = False,
    port: PortOption = None,
    meter: MeterOption = None,
    rig: JointOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
) -> None:
    """Have the heater board follow a scenario's setpoint, and log it as a run of its name.

    Loads of the scenario are not hung: hang them by hand.

    Examples:
        muscle-bayes track square --gains gains.toml --out tracked
        muscle-bayes track pick.toml --real --rig joint.toml --out tracked
    """
    from muscle_bayes.cli.control_options import chosen_scenarios

    period = 0.03
    (one,) = chosen_scenarios([scenario], period, "SCENARIO")
    setpoint = [float(x) for x in one.course.setpoint]

    def aim(time: float) -> float:
        return setpoint[min(int(time / period), len(setpoint) - 1)]

    length = one.length * period
    shortest = length if duration is None else min(duration, length)
    _drive(aim, shortest, one.name, out, gains, real, port, meter, rig, seed, json)


def _drive(
    aim: Callable[[float], float],
    duration: float,
    name: str,
    out: Path,
    gains: Path | None,
    real: bool,
    ports: list[str] | None,
    meter: str | None,
    rig: Path | None,
    seed: int,
    json: Path | None,
) -> None:
    from muscle_bayes.bench.recording.holder import Holder
    from muscle_bayes.bench.recording.run_file import RunFile
    from muscle_bayes.bench.sequences.sequence import Sequence, Stage
    from muscle_bayes.bench.sequences.sequence_file import read_rig, run_metadata
    from muscle_bayes.bench.simulation.recording import NOTES, rig_tables
    from muscle_bayes.progress import shown_progress

    if real and rig is None:
        raise MuscleBayesError("--real needs the joint's tables. Fix: give --rig JOINT.toml")
    tables = {} if rig is None or not real else read_rig(rig)
    if not real and (ports or meter is not None):
        raise MuscleBayesError("--port and --meter go with --real. Fix: add it")
    with ExitStack() as stack:
        simulated = None if real else stack.enter_context(_joint(gains, rig, seed))
        lines = bench_lines(
            ports, meter, None, simulated, otherwise=" Without a bench, leave --real out."
        )
        devices, bench = stack.enter_context(lines)
        board, source = devices.heater.open(), devices.meter.open()
        if bench is not None:
            tables = rig_tables(bench.plant.rig)
        plan = Sequence(stage=(Stage(duration=duration),))
        notes = "" if real else NOTES
        about = run_metadata(
            plan, f"{name}.toml", "measured" if real else "synthetic", tables, 0.0, notes
        )
        report = stack.enter_context(shown_progress())
        holder = Holder(
            board,
            source,
            devices.clock,
            RunFile(out, name, about),
            aim,
            duration,
            progress=lambda time: report("holding, s", int(time), int(duration)),
        )
        outcome = holder.run()
    told = _told(out / f"{name}.csv") | {"rows": outcome.rows, "duration": outcome.duration}
    typer.echo(
        f"{told['path']}: {outcome.rows} rows, {outcome.duration:.1f} s; in the last fifth the error is "
        f"{told['error']:+.4f} rad on average; hottest {told['hottest']:.1f} C"
    )
    write_json(json, told)


@contextmanager
def _joint(
    gains: Path | None, rig: Path | None, seed: int
) -> Iterator[Callable[[], "SimulatedBench"]]:
    """Makes the bench of a simulated joint, its firmware compiled with the gains."""
    from dataclasses import replace
    from functools import partial
    from tempfile import TemporaryDirectory

    from muscle_bayes.bench.simulation.joint import build_firmware, joint_bench
    from muscle_bayes.bench.simulation.recording import rig_tables
    from muscle_bayes.control.laws.gains import gains_header, read_gains
    from muscle_bayes.control.plant.design import Design
    from muscle_bayes.twin.plant.rig import Element

    if gains is None:
        raise MuscleBayesError(
            "the simulated board has no gains. Fix: --gains GAINS.toml of `muscle-bayes tune`, or --real"
        )
    built = simulated_rig(rig)
    if built.element_b.kind != "muscle":
        built = replace(built, element_b=Element(kind="muscle"))
    tables = rig_tables(built)
    design = Design(**{key: tables[key] for key in Design.model_fields})
    with TemporaryDirectory() as folder:
        header = Path(folder) / "gains.h"
        header.write_text(gains_header(read_gains(gains), design))
        yield partial(joint_bench, built, build_firmware(header, Path(folder)), seed)


def _told(log: Path) -> dict[str, Any]:
    """How far off a recorded run ended, and how hot it got."""
    import pandas as pd

    from muscle_bayes.bench.recording.log_row import AIM
    from muscle_bayes.data import read_run

    run = read_run(log)
    wanted = pd.read_csv(log, skipinitialspace=True)[AIM].to_numpy()
    late = len(wanted) // 5
    sensor = run.metadata.potentiometer
    scale = float(sensor.radians_per_count) if sensor and sensor.radians_per_count else 1.0
    read = run.table["reading"].to_numpy()[-late:]
    error = scale * float((wanted[-late:] - read).mean())
    hottest = float(run.table[["temperature_a", "temperature_b"]].max().max())
    return {"path": log, "error": error, "hottest": hottest}
