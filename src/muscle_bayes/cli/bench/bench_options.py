"""What the commands share that talk to the bench."""

import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from muscle_bayes.cli.common import option
from muscle_bayes.errors import MuscleBayesError

if TYPE_CHECKING:
    from muscle_bayes.bench.boards.link import Devices
    from muscle_bayes.bench.simulation import SimulatedBench
    from muscle_bayes.twin.plant.rig import Rig

PortOption = Annotated[
    list[str] | None,
    option(
        "URL",
        "Port of a board, or any URL of pyserial; repeat it for the other board. Boards are "
        "found by themselves unless said.",
        "--port",
    ),
]
MeterOption = Annotated[
    str | None,
    option(
        "[KIND:]URL",
        "Port of the meter; found unless said. KIND is one of an installed package "
        "(docs/bench.md). `board`: the heater board's own thermometers.",
        "--meter",
    ),
]
SensorOption = Annotated[
    list[str] | None,
    option(
        "NAME",
        "With --simulate: what the boards are wired to besides potentiometer and meter, as "
        "`muscle-bayes sensors --list` names it; repeat it.",
        "--sensor",
    ),
]
SimulateOption = Annotated[
    bool,
    typer.Option(
        "--simulate", help="No hardware: the real firmware in simavr, the simulator as plant."
    ),
]
RigOption = Annotated[
    Path | None,
    option(
        "FILE",
        "Rig, where the sequence leaves it out: the tables of any run's NAME.toml. With "
        "--simulate also what is true of it, as for `simulate --rig`.",
        "--rig",
    ),
]


SIMULATE = " Without a bench, give --simulate."


def simulated_rig(path: Path | None) -> "Rig":
    """The simulated bench's rig. Raises MuscleBayesError."""
    from muscle_bayes.twin.overrides import read_rig
    from muscle_bayes.twin.plant.rig import Rig

    return Rig() if path is None else read_rig(path, Rig())


@contextmanager
def bench_lines(
    port: list[str] | None,
    meter: str | None = None,
    sensors: list[str] | None = None,
    simulated: "Callable[[], SimulatedBench] | None" = None,
    otherwise: str = SIMULATE,
) -> Iterator[tuple["Devices", "SimulatedBench | None"]]:
    """Lines of the real bench, or of a simulated one where it is given, and that one.

    They are not open yet, and closed at the end. `otherwise` says what to do without a bench.
    """
    from muscle_bayes.bench.boards.ports import PortFinder

    with ExitStack() as stack:
        stack.enter_context(signals_interrupt())
        bench = None
        if simulated is None:
            if sensors:
                raise MuscleBayesError(
                    "--sensor goes with --simulate. Fix: `muscle-bayes sensors NAME` tells real boards."
                )
            devices = PortFinder(tuple(port or ()), meter, otherwise=otherwise).devices()
        else:
            from muscle_bayes.bench.simulation.recording import simulated_devices

            if port or meter is not None:
                raise MuscleBayesError(
                    "--simulate has no ports. Fix: leave --port and --meter out."
                )
            bench = stack.enter_context(simulated())
            devices = simulated_devices(bench)
        stack.callback(devices.close)
        yield devices, bench


@contextmanager
def signals_interrupt() -> Iterator[None]:
    """Let a request to end, or a terminal that closes, end the command as Ctrl-C does."""
    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {number: signal.signal(number, signal.default_int_handler) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
