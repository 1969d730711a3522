"""`muscle-bayes flash`: the firmware onto a board."""

from pathlib import Path
from typing import Annotated

import typer

from muscle_bayes.cli.common import option
from muscle_bayes.errors import MuscleBayesError


def flash(
    port: Annotated[
        str | None,
        option("PORT", "Port of the board; the only one that may be meant, unless said."),
    ] = None,
    hex: Annotated[
        Path | None, option("FILE", "Another program, as of `make firmware GAINS=`.", "--hex")
    ] = None,
) -> None:
    """Load the firmware onto an Arduino Uno, Duemilanove or Nano, or a clone, and ask who it is.

    Needs avrdude, and tells where to get it. Other boards are refused. Switch the 12 V off first.

    Examples:
        muscle-bayes flash
        muscle-bayes flash --port /dev/ttyUSB0 --hex firmware/build/muscle_bench.hex
    """
    from serial.tools.list_ports import comports

    from muscle_bayes.bench.boards.board import Board
    from muscle_bayes.bench.boards.clock import RealClock
    from muscle_bayes.bench.boards.flashing import (
        SHIPPED,
        check_program,
        choose_port,
        find_avrdude,
        refuse_unfit,
    )
    from muscle_bayes.bench.boards.flashing import flash as load
    from muscle_bayes.bench.boards.transport import SerialTransport

    if hex is not None and not hex.is_file():
        raise MuscleBayesError(f"{hex}: no such file. Fix: run `make firmware`.")
    what = check_program() if hex is None else str(hex)
    chosen = choose_port(comports(), port)
    name = refuse_unfit(chosen)
    avrdude = find_avrdude()
    typer.echo(f"{chosen.device}: {name}; loading {what} ...", err=True)
    baud = load(chosen, hex or SHIPPED, avrdude)
    typer.echo(f"{chosen.device}: loaded at {baud} baud")
    board = Board(SerialTransport(chosen.device), RealClock(), f"board on {chosen.device}")
    try:
        identity = board.identify(5.0)
    finally:
        board.close()
    typer.echo(
        f"{chosen.device}: it answers as a {identity.role.lower()} board, firmware "
        f"{identity.firmware} (pin 4 to GND makes a heater board)"
    )
