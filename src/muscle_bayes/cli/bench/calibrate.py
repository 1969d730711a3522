"""`muscle-bayes calibrate`: the potentiometer's zero and radians per count."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from muscle_bayes.cli.bench.bench_options import (
    PortOption,
    SensorOption,
    SimulateOption,
    bench_lines,
    simulated_rig,
)
from muscle_bayes.cli.common import JsonOption, SeedOption, option, write_json
from muscle_bayes.errors import MuscleBayesError

if TYPE_CHECKING:
    from muscle_bayes.bench.boards.clock import Clock
    from muscle_bayes.bench.boards.link import Devices
    from muscle_bayes.bench.simulation import SimulatedBench

_PERIOD = 0.02
_SHOWN_EVERY = 0.2


def calibrate(
    stops: Annotated[
        tuple[float, float] | None,
        option("LOWER UPPER", "Angles of the endstops, rad; those of --rig unless said."),
    ] = None,
    cycles: Annotated[int, typer.Option(min=2, max=50, help="Turns to and fro.")] = 4,
    first: Annotated[
        Literal["lower", "upper"], typer.Option(help="Endstop to which the rotor is turned first.")
    ] = "lower",
    timeout: Annotated[float, option("S", "Give up after this long.", min=1.0)] = 300.0,
    simulate: SimulateOption = False,
    port: PortOption = None,
    rig: Annotated[
        Path | None,
        option("FILE", "Rig whose endstops are used: the tables of any run's NAME.toml.", "--rig"),
    ] = None,
    sensor: SensorOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
) -> None:
    """Calibrate the potentiometer: turn the rotor by hand from endstop to endstop and back.

    Begin away from the endstops and hold the rotor at each for about a second. Prints the table
    [potentiometer] for NAME.toml or a rig's file. No heater is on.

    Examples:
        muscle-bayes calibrate --stops -1.2 1.2
        muscle-bayes calibrate --simulate
    """
    from muscle_bayes.bench.boards.calibration import ENCODER_BITS, FULL_SCALE
    from muscle_bayes.bench.boards.calibration import calibrate as calibrate_from

    angles = stops or _stops(rig, simulate)
    if not angles[0] < angles[1]:
        raise MuscleBayesError(f"--stops {angles[0]:g} {angles[1]:g}. Fix: lower first.")

    def simulated() -> "SimulatedBench":
        from muscle_bayes.bench.simulation import SimulatedBench, TwinPlant
        from muscle_bayes.bench.simulation.recording import SimulatedHand

        plant = TwinPlant(simulated_rig(rig), seed=seed)
        bench = SimulatedBench(plant, seed, sensors=sensor or [])
        SimulatedHand(bench, plant)
        return bench

    with bench_lines(port, None, sensor, simulated if simulate else None) as (devices, _):
        readings = _turn(devices, 2 * cycles, timeout)
        board = devices.sensor.device
        assert board is not None, "it was just read"
        by_encoder = bool(board.wiring().angle)
        top = 2**ENCODER_BITS - 1 if by_encoder else FULL_SCALE
        found = calibrate_from(readings, angles, first, top)
        if by_encoder:
            board.encoder_marked(mark=True)
    typer.echo(f"[potentiometer]\nzero_reading = {found.zero_reading:.2f}")
    typer.echo(f"radians_per_count = {found.radians_per_count:.6g}")
    if by_encoder:
        typer.echo(f"bits = {ENCODER_BITS}")
    typer.echo(
        f"standard errors: {found.zero_error:.2g} counts, {found.scale_error:.2g} rad per count",
        err=True,
    )
    write_json(json, {"stops": angles, **asdict(found)})


def _stops(rig: Path | None, simulate: bool) -> tuple[float, float]:
    from muscle_bayes.bench.sequences.sequence_file import read_rig

    if simulate:
        return simulated_rig(rig).fixture.stops
    fixture = None if rig is None else read_rig(rig).get("fixture")
    if fixture is None or fixture.stops is None:
        raise MuscleBayesError(
            "the angles of the endstops are not known. Fix: give --stops LOWER UPPER in rad, or "
            "a --rig whose [fixture] has stops."
        )
    return fixture.stops


def _turn(devices: "Devices", wanted: int, timeout: float) -> list[float]:
    """Readings at the endstops, counts, as the rotor is turned."""
    from rich.console import Console

    from muscle_bayes.bench.boards.calibration import EndstopFinder
    from muscle_bayes.bench.boards.samples import SampleStream

    clock: Clock = devices.clock
    finder = EndstopFinder()
    board = devices.sensor.open()
    stream = SampleStream(clock, _PERIOD, lambda kind, **facts: None)
    stream.start(board)
    end, shown = clock.now() + timeout, 0.0
    with Console(stderr=True).status("turn the rotor to and fro") as status:
        while len(finder.found) < wanted:
            clock.sleep(0.005)
            for sample in stream.poll(board):
                finder.feed(sample.reading)
            now = clock.now()
            if now - shown > _SHOWN_EVERY and stream.newest is not None:
                shown = now
                status.update(
                    f"{stream.newest.reading:.1f} counts, {len(finder.found)} of {wanted} endstops"
                )
            if now > end:
                raise MuscleBayesError(
                    f"{len(finder.found)} of {wanted} endstops were reached in {timeout:g} s. "
                    "Fix: turn the rotor from endstop to endstop, or give a longer --timeout."
                )
    board.stream(0)
    return finder.found
