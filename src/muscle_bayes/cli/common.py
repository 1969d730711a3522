"""What the commands share: options and the end of a failed command."""

import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Final

import typer

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.json_file import write_json as write_json

EXIT_USER_ERROR: Final = 2
EXIT_INTERRUPTED: Final = 130

JsonOption = Annotated[
    Path | None, typer.Option("--json", metavar="FILE", help="Also write the result as JSON.")
]
SeedOption = Annotated[int, typer.Option("--seed", min=0, help="Seed of the random numbers.")]


def print_error(error: MuscleBayesError) -> None:
    """Show one message, red, on stderr; long paths stay in one piece."""
    from rich.console import Console

    Console(stderr=True, soft_wrap=True).print(
        f"Error: {error}", style="red", markup=False, highlight=False
    )


@contextmanager
def user_errors() -> Iterator[None]:
    """End the command with a message and exit code 2 on errors that are the user's to mend."""
    try:
        yield
    except MuscleBayesError as error:
        print_error(error)
        raise typer.Exit(EXIT_USER_ERROR) from None
    except KeyboardInterrupt:
        typer.echo("Interrupted.", err=True)
        raise typer.Exit(EXIT_INTERRUPTED) from None


def guarded[**P, R](command: Callable[P, R]) -> Callable[P, R]:
    """A command that runs under `user_errors`."""

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> R:
        with user_errors():
            return command(*args, **kwargs)

    return run
