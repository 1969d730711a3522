"""Files of runs: which there are, and their bytes."""

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from muscle_bayes.data.errors import RunError
from muscle_bayes.errors import did_you_mean

LOG_SUFFIXES: Final = (
    ".csv",
    ".txt",
    ".tsv",
    ".dat",
    ".log",
    ".lvm",
    ".parquet",
    ".h5",
    ".hdf5",
)
"""What a log's name may end in."""


def log_beside(metadata: Path) -> Path:
    """The log that belongs to NAME.toml: the file of that name that ends in one of LOG_SUFFIXES.

    NAME.csv where there are several and it is one of them. Raises RunError where there is none, and
    where there are several others.
    """
    logs = [path for suffix in LOG_SUFFIXES if (path := metadata.with_suffix(suffix)).exists()]
    usual = metadata.with_suffix(".csv")
    if usual in logs:
        return usual
    if not logs:
        read_bytes(metadata)
        raise RunError.at(
            metadata,
            f"no log lies beside it, such as {usual.name}",
            "name a run, or put its log there",
        )
    if len(logs) > 1:
        names = ", ".join(path.name for path in logs)
        raise RunError.at(metadata, f"several logs belong to it: {names}", "keep one, or name it")
    return logs[0]


def find_runs(paths: Sequence[Path | str] | Path | str) -> list[Path]:
    """The log of every run named, or of the one.

    A folder stands for every CSV in it, and for every log of another kind that has a NAME.toml.

    Raises:
        RunError: there is none, or two share a name.
    """
    logs: list[Path] = []
    for path in map(Path, [paths] if isinstance(paths, str | Path) else paths):
        found = _in_folder(path) if path.is_dir() else [path]
        if not found:
            raise RunError.at(path, "no runs: the folder holds no CSV", "name a folder of runs")
        logs += [log_beside(log) if log.suffix == ".toml" else log for log in found]
    if not logs:
        raise RunError("No runs were named. Fix: name a run or a folder of runs.")
    logs = list(dict.fromkeys(logs))  # NAME.csv and NAME.toml both named are one run
    seen: dict[str, Path] = {}
    for log in logs:
        if (other := seen.setdefault(log.stem, log)) is not log:
            raise RunError.at(log, f"duplicate run name, {other} has it too", "rename one of them")
    return logs


def _in_folder(folder: Path) -> list[Path]:
    others = [
        log
        for log in folder.iterdir()
        if log.suffix.lower() in LOG_SUFFIXES
        and log.suffix != ".csv"
        and log.with_suffix(".toml").exists()
    ]
    return sorted([*folder.glob("*.csv"), *others])


def read_bytes(path: Path, fix: str = "correct the path") -> bytes:
    """Content of a file; `fix` says what to do where there is none. Raises RunError."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        near = did_you_mean(path.name, [one.name for one in path.parent.glob("*")])
        raise RunError.at(path, f"no such file.{near}" if near else "no such file", fix) from None
    except OSError as error:
        reason = error.strerror or str(error)
        raise RunError.at(path, f"cannot be read: {reason}", "check the file") from None


def parse_toml(content: bytes, path: Path | str) -> dict[str, Any]:
    """Tables in the bytes of a TOML file; `path` serves the messages. Raises RunError."""
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise RunError.at(
            path, f"line {line} is not UTF-8 text", "save the file as UTF-8"
        ) from None
    except tomllib.TOMLDecodeError as error:
        said, _, place = str(error).partition(" (at ")
        named = re.match(r"line (\d+)", place)
        # At the end of the document the parser names none: the last line that is not empty.
        number = int(named[1]) if named else content.rstrip().count(b"\n") + 1
        raise RunError.at(
            f"{path}, line {number}",
            f"not valid TOML: {said}",
            "correct that line; text needs quotes",
        ) from None
