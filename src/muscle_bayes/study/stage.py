"""One step of the study: skipped when its result stands and nothing it depends on has changed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from muscle_bayes.provenance import fingerprint


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
