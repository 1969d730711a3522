"""Where the built firmware lies."""

import os
from pathlib import Path

from muscle_bayes.errors import MuscleBayesError

_VARIABLE = "MUSCLE_BAYES_FIRMWARE"
_BESIDE_THE_SOURCE = Path(__file__).parents[4] / "firmware" / "build"


def built(name: str) -> Path:
    """A file of the firmware's build folder. Raises MuscleBayesError where it is absent."""
    folder = Path(os.environ.get(_VARIABLE, _BESIDE_THE_SOURCE))
    path = folder / name
    if not path.is_file():
        raise MuscleBayesError(
            f"{path}: the firmware is not built. Fix: run `make firmware` in the project's folder "
            f"(it needs gcc-avr, avr-libc and libsimavr-dev), or point {_VARIABLE} to its build "
            "folder."
        )
    return path
