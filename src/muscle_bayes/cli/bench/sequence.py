"""`muscle-bayes sequence`: the thesis' test regimes as SEQUENCE.toml."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from muscle_bayes.cli.common import option, writable_file
from muscle_bayes.errors import MuscleBayesError


def sequence(
    regime: Annotated[
        Literal["staircase", "sawtooth", "training", "t1", "t2"],
        typer.Argument(
            help="staircase: setpoint in steps up to 90 C and back, a run a load. sawtooth: fast "
            "cycles, load poured on in between. training: cycles at a small load until the motion "
            "repeats. t1: cycles and sweeps at rising loads, six runs. t2: 256 runs, one a pair of "
            "starting and ending loads and temperatures."
        ),
    ],
    out: Annotated[
        Path | None,
        option("SEQUENCE.toml", "File; the terminal unless said.", callback=writable_file),
    ] = None,
    room: Annotated[float, option("C", "Setpoint that stands for the room, C.")] = 25.0,
    mass: Annotated[
        list[float] | None,
        option("KG", "Test load of staircase or sawtooth in kg, as in the file; repeatable."),
    ] = None,
    rig: Annotated[
        Path | None, option("FILE", "Rig to write into it: the tables of any run's NAME.toml.")
    ] = None,
) -> None:
    """Write a test regime as a sequence for `muscle-bayes record`, to be changed at will.

    Examples:
        muscle-bayes sequence staircase --mass 0.139 --out staircase.toml
        muscle-bayes sequence sawtooth --room 22
    """
    from muscle_bayes.bench.sequences.regimes import REGIMES, with_loads
    from muscle_bayes.bench.sequences.sequence_file import read_rig, to_toml

    if not 0.0 <= room <= 45.0:
        raise MuscleBayesError(f"--room {room:g}: no room. Fix: give 0 to 45 C.")
    built = with_loads(regime, room, mass or [])
    if rig is not None:
        built = built.model_copy(update=read_rig(rig))
    text = to_toml(built, f"{regime}: {REGIMES[regime].about}")
    if out is None:
        typer.echo(text, nl=False)
        return
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with out.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError:
        raise MuscleBayesError(f"{out}: exists. Fix: choose another --out.") from None
    count = len(built.runs(out.stem))
    typer.echo(f"{out}: {count} run{'s' if count > 1 else ''}")
