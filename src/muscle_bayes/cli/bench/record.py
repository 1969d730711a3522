"""`muscle-bayes record`: new runs from the bench, real or simulated."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from muscle_bayes.cli.bench.bench_options import (
    SIMULATE,
    MeterOption,
    PortOption,
    RigOption,
    SensorOption,
    SimulateOption,
    real_devices,
    refuse_ports,
    refuse_sensors,
    signals_interrupt,
    simulated_rig,
)
from muscle_bayes.cli.common import FolderOption, JsonOption, SeedOption, write_json
from muscle_bayes.errors import MuscleBayesError

if TYPE_CHECKING:
    from muscle_bayes.bench.recording.loop import Outcome
    from muscle_bayes.bench.recording.session import Session
    from muscle_bayes.bench.sequences.sequence import Sequence


def record(
    sequence: Annotated[
        Path,
        typer.Argument(metavar="SEQUENCE.toml", help="See `muscle-bayes sequence`."),
    ],
    out: FolderOption,
    simulate: SimulateOption = False,
    port: PortOption = None,
    meter: MeterOption = None,
    rig: RigOption = None,
    loaded: Annotated[
        bool, typer.Option("--loaded", help="The first load hangs already: do not ask for it.")
    ] = False,
    clear_faults: Annotated[
        bool, typer.Option("--clear-faults", help="Clear the heater board's faults first.")
    ] = False,
    plot: Annotated[
        bool, typer.Option("--plot", help="Also draw the run in a window while it grows.")
    ] = False,
    sensor: SensorOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
) -> None:
    """Record the runs of SEQUENCE.toml; those that are in DIR already are left out.

    Keys: q ends the run and keeps it, any other key says that the load hangs. The heaters go off
    whatever ends the recording. A run that breaks off is kept, and recorded anew under another
    name when the command is given again.

    Examples:
        muscle-bayes record staircase.toml --out runs
        muscle-bayes record staircase.toml --out runs --simulate
    """
    from time import perf_counter

    from muscle_bayes.bench.recording.live import TerminalView
    from muscle_bayes.bench.sequences.sequence_file import read_sequence

    begun = perf_counter()
    wanted = read_sequence(sequence)
    report: dict[str, Any] = {"sequence": sequence, "simulated": simulate, "runs": []}
    with ExitStack() as stack:
        stack.enter_context(signals_interrupt())
        if simulate:
            refuse_ports(port, meter)
            session = stack.enter_context(
                _simulated(wanted, sequence, out, rig, sensor or [], seed, report)
            )
        else:
            refuse_sensors(sensor)
            session = stack.enter_context(
                _measured(wanted, sequence, out, port, meter, rig, clear_faults)
            )
        if loaded or simulate:
            session.load = session.plans()[0].load
        recorded = session.recorded()
        report["skipped"] = list(recorded)
        for name, attempt in recorded.items():
            of = "" if attempt == name else f" (the complete attempt at {name})"
            typer.echo(f"{out / attempt}.csv{of}: recorded already, left out")
        if plot:
            stack.enter_context(_plotted(session))
        session.view = view = stack.enter_context(TerminalView())
        try:
            for outcome in session.record():
                with view.away():
                    report["runs"].append(_told(outcome, out))
        except MuscleBayesError as error:
            report["error"] = str(error)
            raise
        finally:
            if json is not None:
                write_json(json, report)
        if simulate:
            typer.echo(f"simulated in {perf_counter() - begun:.0f} s")


@contextmanager
def _simulated(
    wanted: "Sequence",
    path: Path,
    out: Path,
    rig: Path | None,
    sensors: list[str],
    seed: int,
    report: dict[str, Any],
) -> Iterator["Session"]:
    from muscle_bayes.bench.recording.session import Session
    from muscle_bayes.bench.simulation import SimulatedBench, TwinPlant
    from muscle_bayes.bench.simulation.recording import (
        NOTES,
        SimulatedOperator,
        rig_of,
        rig_tables,
        simulated_devices,
    )
    from muscle_bayes.twin.simulate import truth_of

    built = rig_of(wanted, simulated_rig(rig))
    load = wanted.runs(path.stem)[0].load
    plant = TwinPlant(
        built, load=load, angle=wanted.initial_angle, hyst=wanted.initial_hyst, seed=seed
    )
    report["seed"] = seed
    report["truth"] = {"zero_reading": plant.zero_reading, **truth_of(built)}
    with SimulatedBench(plant, seed, sensors=sensors) as bench:
        session = Session(
            wanted,
            path,
            out,
            simulated_devices(bench),
            SimulatedOperator(bench, load),
            origin="synthetic",
            rig=rig_tables(built, bench),
            notes=NOTES,
        )
        session.check()
        session.devices.open()
        board = session.devices.sensor.device
        if board is not None and board.wiring().angle:
            board.encoder_marked(mark=True)  # the simulated rig's tables know its zero
        yield session


@contextmanager
def _measured(
    wanted: "Sequence",
    path: Path,
    out: Path,
    ports: list[str] | None,
    meter: str | None,
    rig: Path | None,
    clear_faults: bool,
) -> Iterator["Session"]:
    from time import time

    from muscle_bayes.bench.recording.operator import Keyboard
    from muscle_bayes.bench.recording.session import Session
    from muscle_bayes.bench.sequences.sequence_file import read_rig

    tables = {} if rig is None else read_rig(rig)
    devices = real_devices(ports, meter, SIMULATE)
    keyboard = Keyboard()
    session = Session(wanted, path, out, devices, keyboard, rig=tables, wall_time=time)
    try:
        session.check()
        typer.echo("Looking for the boards and the meter ...", err=True)
        devices.open()
        if clear_faults and (board := devices.heater.device) is not None:
            board.clear()
        yield session
    finally:
        devices.close()
        keyboard.close()


@contextmanager
def _plotted(session: "Session") -> Iterator[None]:
    """A window in a process of its own, so that drawing never delays the heaters' control."""
    import subprocess
    import sys

    names = [plan.name for plan in session.plans()]
    arguments = [
        sys.executable,
        "-m",
        "muscle_bayes.bench.recording.live_plot",
        str(session.folder),
        *names,
    ]
    window = subprocess.Popen(arguments, stdin=subprocess.DEVNULL)
    try:
        yield
    finally:
        window.terminate()
        window.wait()


def _told(outcome: "Outcome", out: Path) -> dict[str, Any]:
    """Print how a run went and give it as JSON."""
    from muscle_bayes.bench.heat.settling import settlings
    from muscle_bayes.data import read_run

    path = out / f"{outcome.name}.csv"
    figures = outcome.figures
    typer.echo(
        f"{path}: {outcome.rows} rows, {outcome.duration:.1f} s, {figures['lost']} samples lost, "
        f"{figures['gaps']} gaps; {outcome.reason}"
    )
    told = asdict(outcome) | {"path": path, "setpoints": []}
    if outcome.rows:
        settled = settlings(read_run(path))
        _show_settlings(settled)
        told["setpoints"] = [asdict(one) for one in settled]
    return told


def _show_settlings(settled: list[Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    if not settled:
        return
    table = Table("side", "at", "setpoint", "step", "settled", "after", "overshoot", "error")
    for one in settled:
        table.add_row(
            one.side.upper(),
            f"{one.start:.0f} s",
            f"{one.setpoint:.1f} C",
            f"{one.step:+.1f} C",
            "yes" if one.settled else "no",
            f"{one.settling_time:.1f} s" if one.settled else "-",
            f"{one.overshoot:.1f} C",
            f"{one.error:+.2f} C",
        )
    Console().print(table)
