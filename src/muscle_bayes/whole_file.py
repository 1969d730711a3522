"""Files that are written whole or not at all, whoever else writes them."""

import os
from pathlib import Path
from threading import get_ident

from muscle_bayes.errors import MuscleBayesError


def write_whole(path: Path, content: bytes) -> None:
    """Replace `path` by a file with this content; of several writers at once, the last one's stays.

    Raises MuscleBayesError where it cannot be written.
    """
    # No two threads share a part: the first would take it from under the second.
    partial = path.with_name(f".{path.name}.{os.getpid()}.{get_ident()}.part")
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
            f"{path}: cannot be written: {reason}. Fix: name a file that can be written."
        ) from None
