"""Results of slow checks of the method, which have commands of their own."""

from collections.abc import Iterable
from pathlib import Path
from typing import Final

FILES: Final = ("calibration.json", "trial.json", "gradient.json", "sampling.json")
"""What `muscle-bayes sbc`, `make trial` and the benchmarks of gradient and sampler write."""


def available(folders: Iterable[Path], own: Path) -> tuple[Path, ...]:
    """Such results in these folders and one below, but for the study's `own`."""
    found = [
        path
        for folder in folders
        for name in FILES
        for path in (*folder.glob(name), *folder.glob(f"*/{name}"))
        if path.parent != own
    ]
    return tuple(sorted(set(found)))
