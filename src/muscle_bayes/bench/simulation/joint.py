"""A simulated antagonistic joint under the real firmware, gains compiled in."""

import shutil
import subprocess
from pathlib import Path
from typing import Final

from muscle_bayes.bench.simulation.bench import SimulatedBench
from muscle_bayes.bench.simulation.plant import TwinPlant
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin.rig import Rig

SOURCES: Final = Path(__file__).parents[4] / "firmware"


def build_firmware(header: Path, folder: Path) -> Path:
    """Compile the firmware with a header of gains into a folder; its program. Raises MuscleBayesError."""
    if shutil.which("avr-gcc") is None or not (SOURCES / "Makefile").is_file():
        raise MuscleBayesError(
            "the firmware cannot be compiled here. Fix: work in the project's folder and run `make "
            "firmware-tools` once, or drive the real bench with --real"
        )
    target = folder / "muscle_bench.elf"
    command = [
        "make",
        "-s",
        "-C",
        SOURCES,
        f"GAINS={header.resolve()}",
        f"BUILD={folder.resolve()}",
    ]
    made = subprocess.run(
        [*map(str, command), str(target.resolve())], capture_output=True, text=True, check=False
    )
    if made.returncode != 0:
        raise MuscleBayesError(
            f"{header}: the firmware does not compile with it: {made.stderr.strip()[-300:]}. "
            "Fix: write the header with `muscle-bayes tune --header`"
        )
    return target


def joint_bench(rig: Rig, elf: Path, seed: int = 0) -> SimulatedBench:
    """A rig of two muscles without load; the potentiometer is wired to the heater board as well."""
    bench = SimulatedBench(TwinPlant(rig, load=0.0, hyst=0.02, seed=seed), seed, elf=elf)

    def show(_: int) -> None:
        bench.heater.set_analog(bench.plant.counts())

    show(0)
    bench.listeners.append(show)
    return bench
