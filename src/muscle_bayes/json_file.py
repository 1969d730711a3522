"""Results as JSON files: standard JSON, written whole or not at all."""

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from muscle_bayes.errors import MuscleBayesError


def write_whole(path: Path, content: bytes) -> None:
    """Replace `path` by a file with this content. Raises MuscleBayesError where it cannot be written."""
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            partial.write_bytes(content)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise MuscleBayesError(
            f"{path}: cannot be written: {reason}. Mend: name a file that can be written."
        ) from None


def write_json(path: Path, data: Any) -> None:
    """Write standard JSON whole or not at all; keys in the order given, NaN and infinity as null.

    Raises MuscleBayesError where the file cannot be written.
    """
    text = json.dumps(plain(data), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    write_whole(path, text.encode())


def plain(value: Any) -> Any:
    """JSON's own types for the arrays, numbers and paths that results hold."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # numpy arrays and scalars, without importing numpy
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (set, frozenset)):
        return sorted(plain(item) for item in value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    return value
