"""NAME.toml -> Metadata, with errors that name file, key and fix."""

from pathlib import Path

from muscle_bayes.data.describing.metadata import Metadata
from muscle_bayes.data.validation import parse_table, read_table


def read_metadata(path: Path) -> Metadata:
    """Read NAME.toml. Raises RunError."""
    return read_table(path, Metadata)


def parse_metadata(content: bytes, path: Path | str) -> Metadata:
    """The metadata in the bytes of a TOML file; `path` serves the messages. Raises RunError."""
    return parse_table(content, path, Metadata)
