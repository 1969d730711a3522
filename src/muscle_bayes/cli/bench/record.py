"""`muscle-bayes record`: new runs from the bench, real or simulated."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from muscle_bayes.cli.bench.bench_options import (
    MeterOption,
    PortOption,
    RigOption,
    SensorOption,
    SimulateOption,
    bench_lines,
    simulated_rig,
)
from muscle_bayes.cli.common import FolderOption, JsonOption, SeedOption, write_json
from muscle_bayes.errors import MuscleBayesError

if TYPE_CHECKING:
    from muscle_bayes.bench.boards.link import Devices
    from muscle_bayes.bench.recording.loop import Outcome
    from muscle_bayes.bench.recording.session import Session
    from muscle_bayes.bench.sequences.sequence import Sequence
    from muscle_bayes.bench.simulation import SimulatedBench


def record(
    sequence: Annotated[
        Path, typer.Argument(metavar="SEQUENCE.toml", help="See `muscle-bayes sequence`.")
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
    from time import perf_counter, time

    from muscle_bayes.bench.recording.live import TerminalView
    from muscle_bayes.bench.recording.operator import Keyboard
    from muscle_bayes.bench.recording.session import Session
    from muscle_bayes.bench.sequences.sequence_file import read_rig, read_sequence

    begun = perf_counter()
    wanted = read_sequence(sequence)
    report: dict[str, Any] = {"sequence": sequence, "simulated": simulate, "runs": []}
    with ExitStack() as stack:
        simulated = partial(_simulated_bench, wanted, sequence, rig, sensor or [], seed)
        lines = bench_lines(
            port, meter, None if simulate else sensor, simulated if simulate else None
        )
        devices, bench = stack.enter_context(lines)
        if bench is None:
            operator = Keyboard()
            stack.callback(operator.close)
            tables = {} if rig is None else read_rig(rig)
            session = Session(wanted, sequence, out, devices, operator, rig=tables, wall_time=time)
            session.check()
            typer.echo("Looking for the boards and the meter ...", err=True)
            devices.open()
            if clear_faults and (board := devices.heater.device) is not None:
                board.clear()
        else:
            session = _simulated_session(wanted, sequence, out, devices, bench)
            report |= {"seed": seed, "truth": _truth(bench)}
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
            write_json(json, report)
        if simulate:
            typer.echo(f"simulated in {perf_counter() - begun:.0f} s")


def _simulated_bench(
    wanted: "Sequence", path: Path, rig: Path | None, sensors: list[str], seed: int
) -> "SimulatedBench":
    """The firmware with a plant as sequence and rig describe it."""
    from muscle_bayes.bench.simulation import SimulatedBench, TwinPlant
    from muscle_bayes.bench.simulation.recording import rig_of

    plant = TwinPlant(
        rig_of(wanted, simulated_rig(rig)),
        load=wanted.runs(path.stem)[0].load,
        angle=wanted.initial_angle,
        hyst=wanted.initial_hyst,
        seed=seed,
    )
    return SimulatedBench(plant, seed, sensors=sensors)


def _simulated_session(
    wanted: "Sequence", path: Path, out: Path, devices: "Devices", bench: "SimulatedBench"
) -> "Session":
    """A session on open simulated devices, with somebody who hangs its loads."""
    from muscle_bayes.bench.recording.session import Session
    from muscle_bayes.bench.simulation.recording import NOTES, SimulatedOperator, rig_tables

    plant = bench.plant
    session = Session(
        wanted,
        path,
        out,
        devices,
        SimulatedOperator(bench, plant.load),
        origin="synthetic",
        rig=rig_tables(plant.rig, bench),
        notes=NOTES,
    )
    session.check()
    devices.open()
    board = devices.sensor.device
    if board is not None and board.wiring().angle:
        board.encoder_marked(mark=True)  # the simulated rig's tables know its zero
    return session


def _truth(bench: "SimulatedBench") -> dict[str, Any]:
    from muscle_bayes.twin.simulate import truth_of

    return {"zero_reading": bench.plant.zero_reading, **truth_of(bench.plant.rig)}


@contextmanager
def _plotted(session: "Session") -> Iterator[None]:
    """A window in a process of its own, so that drawing never delays the heaters' control."""
    import subprocess
    import sys

    names = [plan.name for plan in session.plans()]
    drawing = [sys.executable, "-m", "muscle_bayes.bench.recording.live_plot"]
    window = subprocess.Popen([*drawing, session.folder, *names], stdin=subprocess.DEVNULL)
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
