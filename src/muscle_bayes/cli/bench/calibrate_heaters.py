"""`muscle-bayes calibrate-heaters`: what the heater board must know of its tubes."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from muscle_bayes.cli.bench.bench_options import (
    MeterOption,
    PortOption,
    SensorOption,
    SimulateOption,
    bench_lines,
)
from muscle_bayes.cli.common import JsonOption, SeedOption, option, write_json

if TYPE_CHECKING:
    from muscle_bayes.bench.simulation import SimulatedBench


def calibrate_heaters(
    side: Annotated[
        Literal["a", "b", "both"], typer.Option(help="The tubes that are there.")
    ] = "both",
    room: Annotated[float, option("C", "Temperature of the room, C.", min=5.0, max=45.0)] = 25.0,
    simulate: SimulateOption = False,
    port: PortOption = None,
    meter: MeterOption = None,
    sensor: SensorOption = None,
    seed: SeedOption = 0,
    json: JsonOption = None,
) -> None:
    """Measure how fast each heater tube warms and cools, and store it on the heater board.

    Needed once for each tube, and again after a change of tube, heater or 12 V supply. With it the
    board knows how hot a tube may be, whatever its thermocouple shows. Every tube gets 15 s of heat
    and is followed for 90 s as it cools. Stay beside it.

    Examples:
        muscle-bayes calibrate-heaters --room 22
        muscle-bayes calibrate-heaters --side a --simulate
    """
    from muscle_bayes.bench.heat.tube_calibration import calibrate_tube

    def simulated() -> "SimulatedBench":
        from muscle_bayes.bench.simulation import SimulatedBench

        return SimulatedBench(seed=seed, calibrated=False, sensors=sensor or [])

    with bench_lines(port, meter, sensor, simulated if simulate else None) as (devices, _):
        board, source = devices.heater.open(), devices.meter.open()
        report: dict[str, Any] = {}
        for channel in {"a": (0,), "b": (1,), "both": (0, 1)}[side]:
            name = "AB"[channel]
            typer.echo(f"heater {name}: 15 s of heat, then 90 s of cooling ...", err=True)
            fit = calibrate_tube(board, source, devices.clock, channel, room)
            typer.echo(
                f"tube {name}: {fit.tube.rate:.2f} C/s at full power, cools in "
                f"{fit.tube.cooling_time:.1f} s; stored on the board"
            )
            report[name] = asdict(fit)
    write_json(json, report)
