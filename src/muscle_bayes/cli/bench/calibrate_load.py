"""`muscle-bayes calibrate-load`: the load cell's zero and kilograms per count."""

from typing import TYPE_CHECKING, Annotated

import typer

from muscle_bayes.cli.bench.bench_options import PortOption, SimulateOption, bench_lines
from muscle_bayes.cli.common import SeedOption, option
from muscle_bayes.errors import MuscleBayesError

if TYPE_CHECKING:
    from muscle_bayes.bench.boards.link import Devices
    from muscle_bayes.bench.simulation import SimulatedBench

_WEIGHED = 3.0
"""s over which counts are averaged."""


def calibrate_load(
    mass: Annotated[float, option("KG", "A known mass.", min=0.001, max=20.0)],
    simulate: SimulateOption = False,
    port: PortOption = None,
    seed: SeedOption = 0,
) -> None:
    """Calibrate the load cell: with nothing on it, then with a known mass.

    Prints the table [load_cell] for a sequence or a rig's file.

    Examples:
        muscle-bayes calibrate-load --mass 0.2
        muscle-bayes calibrate-load --mass 0.2 --simulate
    """

    def simulated() -> "SimulatedBench":
        from muscle_bayes.bench.simulation import SimulatedBench, TwinPlant

        return SimulatedBench(TwinPlant(load=0.0, seed=seed), seed, sensors=["hx711"])

    with bench_lines(port, simulated=simulated if simulate else None) as (devices, bench):
        devices.sensor.open()
        if bench is None:
            typer.confirm("Does nothing hang on the load cell?", abort=True)
        zero = _counts(devices)
        if bench is not None:
            bench.plant.hang(mass)
            devices.clock.sleep(1.0)
        else:
            typer.confirm(f"Do {1000 * mass:g} g hang, and hang still?", abort=True)
        loaded = _counts(devices)
    if abs(loaded - zero) < 100:
        raise MuscleBayesError(
            f"{1000 * mass:g} g change the load cell by {loaded - zero:.0f} counts. Fix: check its "
            "four wires and which way it bends."
        )
    typer.echo(f"[load_cell]\nzero = {zero:.1f}\nkg_per_count = {mass / (loaded - zero):.6g}")


def _counts(devices: "Devices") -> float:
    """Mean of the cell's counts over some seconds."""
    from muscle_bayes.bench.boards.samples import SampleStream

    board, clock = devices.sensor.device, devices.clock
    assert board is not None, "it is open"
    board.poll()  # what was sent before
    stream = SampleStream(clock, 0.1, lambda kind, **facts: None)
    stream.start(board)
    counts: list[int] = []
    end = clock.now() + _WEIGHED
    while clock.now() < end:
        clock.sleep(0.01)
        counts += [sample.load for sample in stream.poll(board) if sample.load is not None]
    board.stream(0)
    if len(counts) < _WEIGHED:
        raise MuscleBayesError(
            "the load cell says nothing. Fix: wire its HX711 to pins 8 and 9 of the sensor board, and "
            "tell the board: `muscle-bayes sensors hx711`."
        )
    return sum(counts) / len(counts)
