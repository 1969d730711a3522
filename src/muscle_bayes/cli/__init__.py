"""The command line. Each command is a module of its own; heavy imports wait inside the commands."""

from typing import Annotated

import typer

from muscle_bayes.cli.common import guarded
from muscle_bayes.cli.inspect import inspect
from muscle_bayes.cli.simulate import simulate

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


app.command("inspect")(guarded(inspect))
app.command("simulate")(guarded(simulate))


def main() -> None:
    """Run the command line."""
    app()
