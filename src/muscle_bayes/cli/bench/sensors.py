"""`muscle-bayes sensors`: what the boards are wired to besides potentiometer and meter."""

from typing import Annotated

import typer

from muscle_bayes.cli.bench.bench_options import PortOption, bench_lines
from muscle_bayes.cli.common import option


def sensors(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NAME]...", help="Sensors that are wired; absent: only tell."),
    ] = None,
    none: Annotated[
        bool, typer.Option("--none", help="Only potentiometer and meter are wired.")
    ] = False,
    show_list: Annotated[bool, typer.Option("--list", help="List the sensors and their pins.")] = (
        False
    ),
    beta: Annotated[int, option("K", "Of the thermistors.", min=1000, max=9999)] = 3950,
    ratio: Annotated[
        float,
        typer.Option(
            min=0.01, max=65.0, help="Series resistor to the thermistor's resistance at 25 C."
        ),
    ] = 1.0,
    port: PortOption = None,
) -> None:
    """Tell both boards what they are wired to; they keep it.

    Thermometers of the heater board then take the meter's place, and switch the heaters off without
    a host.

    Examples:
        muscle-bayes sensors --list
        muscle-bayes sensors max31855 encoder hx711
    """
    from muscle_bayes.bench.boards.messages import Role
    from muscle_bayes.bench.sensors.catalogue import SENSORS, names_of, wiring_of

    if show_list:
        for sensor in SENSORS.values():
            typer.echo(f"{sensor.name}: {sensor.what}, {sensor.role.lower()} board")
            for pin, to in sensor.pins:
                typer.echo(f"  {pin:>3}  {to}")
        return
    wanted = {role: wiring_of(names or (), role, beta=beta, ratio=ratio) for role in Role}
    with bench_lines(port, otherwise="") as (devices, _):
        for role, link in ((Role.HEATER, devices.heater), (Role.SENSOR, devices.sensor)):
            board = link.open()
            if names or none:
                board.wire(wanted[role])
            told = ", ".join(names_of(board.wiring())) or "nothing more"
            typer.echo(f"{link.name}: {told}")
