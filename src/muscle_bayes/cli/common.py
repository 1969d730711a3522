"""What the commands share: options, the end of a failed command, files written whole."""

import functools
import json
import math
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from muscle_bayes.errors import MuscleBayesError

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


def write_json(path: Path, data: Any) -> None:
    """Write standard JSON whole or not at all; keys in the order given, NaN and infinity as null.

    Raises MuscleBayesError where the file cannot be written.
    """
    text = json.dumps(_plain(data), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            partial.write_text(text, encoding="utf-8", newline="\n")
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise MuscleBayesError(
            f"{path}: cannot be written: {reason}. Mend: name a file that can be written."
        ) from None


def _plain(value: Any) -> Any:
    """JSON's own types for the arrays, numbers and paths that reports hold."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # numpy arrays and scalars, without importing numpy
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, (set, frozenset)):
        return sorted(_plain(item) for item in value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    return value
