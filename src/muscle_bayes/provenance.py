"""What a result was made from, as checksums."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def fingerprint(inputs: Mapping[str, Any]) -> str:
    """SHA-256 of what a result depends on: checksums of runs, settings, versions, earlier results."""
    text = json.dumps(inputs, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def source_checksum(*layers: str) -> str:
    """SHA-256 over the source of these layers, so that what changed code made is made again.

    A layer is a folder of the package, or a file in one.
    """
    digest = hashlib.sha256()
    root = Path(__file__).parent
    for layer in layers:
        place = root / layer
        for path in [place] if place.is_file() else sorted(place.rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()
