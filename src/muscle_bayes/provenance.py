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
    """SHA-256 over the source of these layers, so that what changed code made is made again."""
    digest = hashlib.sha256()
    root = Path(__file__).parent
    for layer in layers:
        for path in sorted((root / layer).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()
