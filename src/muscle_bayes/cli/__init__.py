"""The command line. Each command is a module of its own; heavy imports wait inside the commands."""

from typing import Annotated

import typer

from muscle_bayes.cli.bench_test import bench_test
from muscle_bayes.cli.calibrate import calibrate
from muscle_bayes.cli.check import check
from muscle_bayes.cli.common import guarded
from muscle_bayes.cli.discover import discover
from muscle_bayes.cli.fit import fit
from muscle_bayes.cli.init import init
from muscle_bayes.cli.inspect import inspect
from muscle_bayes.cli.record import record
from muscle_bayes.cli.robustness import robustness
from muscle_bayes.cli.sbc import sbc
from muscle_bayes.cli.sequence import sequence
from muscle_bayes.cli.simulate import simulate
from muscle_bayes.cli.study import study
from muscle_bayes.cli.trial import trial
from muscle_bayes.cli.tune import tune
from muscle_bayes.compiled import keep_compiled_code

app = typer.Typer(
    name="muscle-bayes",
    help="Bayesian calibration of coiled-nylon artificial muscles and of the rigs that test them.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


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


app.command("init")(guarded(init))
app.command("inspect")(guarded(inspect))
app.command("fit")(guarded(fit))
app.command("check")(guarded(check))
app.command("discover")(guarded(discover))
app.command("simulate")(guarded(simulate))
app.command("sequence")(guarded(sequence))
app.command("calibrate")(guarded(calibrate))
app.command("record")(guarded(record))
app.command("bench-test")(guarded(bench_test))
app.command("robustness")(guarded(robustness))
app.command("tune")(guarded(tune))
app.command("sbc")(guarded(sbc))
app.command("trial")(guarded(trial))
app.command("study")(guarded(study))


def main() -> None:
    """Run the command line."""
    keep_compiled_code()
    app()
