"""A simulated antagonistic joint under the real firmware, gains compiled in."""

import shutil
import subprocess
from pathlib import Path
from typing import Final

from muscle_bayes.bench.simulation.bench import SimulatedBench
from muscle_bayes.bench.simulation.plant import TwinPlant
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin.plant.rig import Rig

RESTED, REST_STEP = 900.0, 0.1
"""Time for which the muscles have been in the joint, and the steps in which it is simulated [s]."""
SOURCES: Final = Path(__file__).parents[4] / "firmware"


def build_firmware(header: Path, folder: Path) -> Path:
    """Compile the firmware with a header of gains into a folder; its program. Raises MuscleBayesError."""
    if shutil.which("avr-gcc") is None or not (SOURCES / "Makefile").is_file():
        raise MuscleBayesError(
            "the firmware cannot be compiled here. Fix: work in the project's folder and run `make "
            "firmware-tools` once, or drive the real bench with --real"
        )
    target = folder / "muscle_bench.elf"
    told = [f"GAINS={header.resolve()}", f"BUILD={folder.resolve()}", str(target.resolve())]
    made = subprocess.run(["make", "-s", "-C", SOURCES, *told], capture_output=True, text=True)
    if made.returncode != 0:
        raise MuscleBayesError(
            f"{header}: the firmware does not compile with it: {made.stderr.strip()[-300:]}. "
            "Fix: write the header with `muscle-bayes tune --header`"
        )
    return target


def joint_bench(rig: Rig, elf: Path, seed: int = 0) -> SimulatedBench:
    """A rig of two muscles that have rested without load; the potentiometer is the heater board's, too."""
    plant = TwinPlant(rig, load=0.0, seed=seed)
    for _ in range(round(RESTED / REST_STEP)):
        plant.advance((0.0, 0.0), REST_STEP)
    plant.bench.place(None)
    bench = SimulatedBench(plant, seed, elf=elf)

    def show(_: int) -> None:
        bench.heater.set_analog(bench.plant.counts())

    show(0)
    bench.listeners.append(show)
    return bench
