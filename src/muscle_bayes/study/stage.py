"""One step of the study: skipped when its result stands and nothing it depends on has changed."""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any


def fingerprint(inputs: Mapping[str, Any]) -> str:
    """SHA-256 of the inputs of a stage: checksums of runs, settings, versions, earlier stages."""
    text = json.dumps(inputs, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def source_checksum(*layers: str) -> str:
    """SHA-256 over the source of these layers, so that what changed code made is made again."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[1]
    for layer in layers:
        for path in sorted((root / layer).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()


@dataclass(frozen=True)
class Stage:
    """A named step that writes `result`; its stamp tells from which inputs."""

    name: str
    result: Path
    inputs: Mapping[str, Any]
    make: Callable[[], None]

    @property
    def stamp(self) -> Path:
        return self.result.with_suffix(".stamp")

    def done(self) -> bool:
        """Whether the result stands for these very inputs."""
        if not (self.result.exists() and self.stamp.exists()):
            return False
        return self.stamp.read_text() == fingerprint(self.inputs)

    def run(self) -> bool:
        """Make the result unless it stands; returns whether it was made."""
        if self.done():
            return False
        self.stamp.unlink(missing_ok=True)
        self.make()
        self.stamp.write_text(fingerprint(self.inputs))
        return True
