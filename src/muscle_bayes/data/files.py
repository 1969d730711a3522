"""Bytes of a run's files."""

import tomllib
from pathlib import Path
from typing import Any

from muscle_bayes.data.errors import RunError


def read_bytes(path: Path, what: str) -> bytes:
    """Content of a file; `what` names its part in the run. Raises RunError."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise RunError.at(path, f"{what} is missing", f"put {path.name} there") from None
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
        raise RunError.at(
            path, f"not valid TOML: {error}", "correct that line; text needs quotes"
        ) from None
