"""The command line. Each command is a module of its own; heavy imports wait inside the commands."""

from collections.abc import Callable
from typing import Annotated, Final

import typer

from muscle_bayes.cli.bench.calibrate import calibrate
from muscle_bayes.cli.bench.calibrate_heaters import calibrate_heaters
from muscle_bayes.cli.bench.calibrate_load import calibrate_load
from muscle_bayes.cli.bench.flash import flash
from muscle_bayes.cli.bench.hold import hold, track
from muscle_bayes.cli.bench.record import record
from muscle_bayes.cli.bench.sensors import sensors
from muscle_bayes.cli.bench.sequence import sequence
from muscle_bayes.cli.check import check
from muscle_bayes.cli.common import EXIT_CODES, Commands
from muscle_bayes.cli.demo import demo
from muscle_bayes.cli.discover import discover
from muscle_bayes.cli.effects import effects
from muscle_bayes.cli.fit import fit
from muscle_bayes.cli.init import init
from muscle_bayes.cli.inspect import inspect
from muscle_bayes.cli.population import population
from muscle_bayes.cli.robustness import robustness
from muscle_bayes.cli.sbc import sbc
from muscle_bayes.cli.show import show
from muscle_bayes.cli.simulate import simulate
from muscle_bayes.cli.study import study
from muscle_bayes.cli.tune import tune
from muscle_bayes.compiled import keep_compiled_code

app = typer.Typer(
    name="muscle-bayes",
    cls=Commands,
    help="Bayesian calibration of coiled-nylon artificial muscles and of the rigs that test them.",
    epilog=f"`muscle-bayes COMMAND --help` shows examples.\n\n{EXIT_CODES}",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

GROUPS: Final[dict[str, tuple[Callable[..., None], ...]]] = {
    "Begin": (demo, study),
    "Calibrate": (init, inspect, fit, show, check),
    "Discover": (effects, discover),
    "Control": (population, tune, robustness, hold, track),
    "Bench": (flash, sensors, calibrate, calibrate_heaters, calibrate_load, sequence, record),
    "Checks of the method": (simulate, sbc),
}
"""Commands as the help lists them."""


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"muscle-bayes {version('muscle-bayes')}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    pass


for _group, _commands in GROUPS.items():
    for _command in _commands:
        app.command(_command.__name__.replace("_", "-"), rich_help_panel=_group)(_command)


def main() -> None:
    """Run the command line."""
    keep_compiled_code()
    app()
