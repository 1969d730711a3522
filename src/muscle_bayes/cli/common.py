"""What the commands share: options, tests of where results go, and the end of a failed command."""

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import typer
from rich.markup import escape
from typer.core import TyperGroup

from muscle_bayes import json_file
from muscle_bayes.errors import MuscleBayesError

EXIT_FAILED: Final = 1
"""Not converged, not explained, or a test that failed."""
EXIT_USER_ERROR: Final = 2
EXIT_INTERRUPTED: Final = 130
LOGS: Final = (".csv", ".txt", ".tsv", ".dat", ".log", ".lvm", ".parquet", ".h5", ".hdf5")
"""What no result replaces."""
EXIT_CODES: Final = (
    "Exit codes: 0 fine; 1 not converged, not explained or failed; 2 wrong input; 130 interrupted."
)


def option(metavar: str | None, text: str, *flags: str, **more: Any) -> Any:
    """An option: what stands for its value, and its help; `flags` where the parameter's name is no name."""
    return typer.Option(*flags, metavar=metavar, help=text, **more)


def writable_file(option: typer.CallbackParam, value: Path | None) -> Path | None:
    """Callback of an option that names a file to be written: tested before anything is computed."""
    if value is not None:
        if value.is_dir():
            raise _unwritable(option, value, "it is a folder", "name a file")
        wanted = Path(str(option.metavar)).suffix
        if wanted and value.suffix != wanted:
            raise _unwritable(option, value, "of another kind", f"end the name in {wanted}")
        if value.exists() and value.suffix in LOGS:
            raise _unwritable(option, value, "it may be a log", "name another")
        _try_to_write(option, value, value.parent)
        if value.exists() and not os.access(value, os.W_OK):
            raise _unwritable(option, value, os.strerror(errno.EACCES), "name another")
    return value


def writable_folder(option: typer.CallbackParam, value: Path | None) -> Path | None:
    """Callback of an option that names a folder to be filled: tested before anything is computed."""
    if value is not None:
        _try_to_write(option, value, value)
    return value


def _try_to_write(option: typer.CallbackParam, value: Path, folder: Path) -> None:
    """Write and remove a file in the nearest folder that exists."""
    try:
        while not folder.exists() and folder != folder.parent:
            folder = folder.parent
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise _unwritable(option, value, error.strerror or str(error), "name another") from None


def _unwritable(
    option: typer.CallbackParam, value: Path, reason: str, fix: str
) -> MuscleBayesError:
    flag = option.opts[0]
    return MuscleBayesError(f"{flag} {value}: cannot be written: {reason}. Fix: {fix}.")


JsonOption = Annotated[
    Path | None, option("FILE", "Also write the result as JSON.", "--json", callback=writable_file)
]
SeedOption = Annotated[int, option("N", "Seed of the random numbers.", "--seed", min=0)]
RunsArgument = Annotated[
    list[Path], typer.Argument(metavar="RUN...", help="NAME.csv, NAME.toml or a folder of runs.")
]
FittedArgument = Annotated[
    Path, typer.Argument(metavar="POSTERIOR.nc", help="Written by `muscle-bayes fit`.")
]
FolderOption = Annotated[
    Path, option("DIR", "Folder of the results.", "--out", callback=writable_folder)
]
SchedulerOption = Annotated[
    str | None, option("ADDRESS", "Dask scheduler, as tcp://HOST:8786; default: here.")
]
WorkersOption = Annotated[int, option("N", "Processes on this machine.", min=1)]


def print_error(error: MuscleBayesError) -> None:
    """Show one message, red, on stderr; long paths stay in one piece."""
    from rich.console import Console

    Console(stderr=True, soft_wrap=True).print(
        f"Error: {error}", style="red", markup=False, highlight=False
    )


def write_json(path: Path | None, content: Any) -> None:
    """Write a result as JSON, where somebody wants it."""
    if path is not None:
        json_file.write_json(path, content)


@contextmanager
def user_errors() -> Iterator[None]:
    """End the command with one message: code 2 for wrong input, 130 when interrupted."""
    try:
        yield
    except MuscleBayesError as error:
        print_error(error)
        raise typer.Exit(EXIT_USER_ERROR) from None
    except OSError as error:
        if error.filename is None or error.errno == errno.EPIPE:
            raise
        reason = error.strerror or str(error)
        print_error(MuscleBayesError(f"{error.filename}: {reason}. Fix: see that it can be used."))
        raise typer.Exit(EXIT_USER_ERROR) from None
    except (KeyboardInterrupt, typer.Abort):
        with suppress(OSError):
            typer.echo("Interrupted.", err=True)
        raise typer.Exit(EXIT_INTERRUPTED) from None


def _dress(option: Any) -> None:
    """One look for all options: N for whole numbers, X for others, nothing for flags."""
    if text := getattr(option, "help", None):
        option.help = escape(text)
    if getattr(option, "is_flag", False):
        option.metavar = " "
    elif option.metavar is None:
        kind = option.bare_type()
        option.metavar = "N" if "int" in kind else "X" if "float" in kind else None


class Commands(TyperGroup):
    """All commands: each shows examples and exit codes in its help, and fails with one message."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        for command in self.commands.values():
            about, _, examples = (command.help or "").partition("Examples:\n")
            paragraphs = [" ".join(one.split()) for one in about.strip().split("\n\n")]
            command.help = escape("\n\n".join(paragraphs))
            shown = [f"  {line.strip()}" for line in examples.splitlines() if line.strip()]
            command.epilog = escape("\n".join(["Examples:", *shown]) + f"\n\n{EXIT_CODES}")
            for option in command.params:
                _dress(option)

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]
        """Run a command under `user_errors`, reading its options included."""
        with user_errors():
            return super().invoke(ctx)  # type: ignore[arg-type]


Device = Literal["cpu", "gpu"]
DeviceOption = Annotated[
    Device, typer.Option("--device", help="What computes; gpu needs JAX with CUDA or ROCm.")
]


def compute_on(device: Device) -> None:
    """Have JAX compute on this kind of device. Must be called before anything is computed.

    Raises MuscleBayesError where JAX finds no such device.
    """
    typer.echo(f"starting JAX on the {device} ...", err=True)
    import jax

    jax.config.update("jax_platforms", "cpu" if device == "cpu" else None)
    if device == "cpu":
        return
    os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")
    try:
        jax.devices("gpu")
    except RuntimeError:
        raise MuscleBayesError(
            "--device gpu: JAX finds no GPU. Fix: install JAX with CUDA (`pip install "
            "'jax[cuda13]'`) on a machine that has one, or use --device cpu"
        ) from None
