"""NAME.toml -> Metadata, with errors that name file, key and fix."""

from pathlib import Path

from pydantic import ValidationError

from muscle_bayes.data.describing.metadata import Metadata
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.files import parse_toml, read_bytes
from muscle_bayes.data.validation import explain


def read_metadata(path: Path) -> Metadata:
    """Read NAME.toml. Raises RunError."""
    return parse_metadata(read_bytes(path, "the run's metadata"), path)


def parse_metadata(content: bytes, path: Path | str) -> Metadata:
    """The metadata in the bytes of a TOML file; `path` serves the messages. Raises RunError."""
    tables = parse_toml(content, path)
    try:
        return Metadata.model_validate(tables)
    except ValidationError as error:
        key, problem, fix = explain(error, Metadata)
        raise RunError.at(path, problem, fix, key=key) from None
