"""Bytes of a run's files."""

import tomllib
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

    NAME.csv where there is none, or where there are several and it is one of them. Raises RunError
    where there are several others.
    """
    logs = [path for suffix in LOG_SUFFIXES if (path := metadata.with_suffix(suffix)).exists()]
    usual = metadata.with_suffix(".csv")
    if not logs or usual in logs:
        return usual
    if len(logs) > 1:
        names = ", ".join(path.name for path in logs)
        raise RunError.at(metadata, f"several logs belong to it: {names}", "keep one, or name it")
    return logs[0]


def read_bytes(path: Path, what: str) -> bytes:
    """Content of a file; `what` names its part in the run. Raises RunError."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        near = did_you_mean(path.name, _names_beside(path))
        problem = f"{what} is missing.{near}" if near else f"{what} is missing"
        raise RunError.at(path, problem, f"put {path.name} there") from None
    except OSError as error:
        reason = error.strerror or str(error)
        raise RunError.at(path, f"cannot be read: {reason}", "check the file") from None


def _names_beside(path: Path) -> list[str]:
    return [one.name for one in path.parent.iterdir()] if path.parent.is_dir() else []


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
        raise RunError.at(
            path, f"not valid TOML: {error}", "correct that line; text needs quotes"
        ) from None
