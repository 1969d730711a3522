"""Bytes of a run's files."""

from pathlib import Path

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
