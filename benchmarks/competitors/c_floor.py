"""The floor: our algorithm with hand-written forward sensitivities in C, compiled on the spot."""

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from jaxtyping import Float

from benchmarks.competitors.protocol import Simulator
from benchmarks.problem import INPUTS, Lane
from muscle_bayes.inference.model.problem import Problem

SOURCE = Path(__file__).with_name("floor.c")
FLAGS = ("-O3", "-march=native", "-shared", "-fPIC")
_DOUBLES = ctypes.POINTER(ctypes.c_double)


def compiler() -> str | None:
    """Path of the C compiler, or None."""
    return shutil.which("gcc") or shutil.which("cc")


def _compiled() -> ctypes.CDLL:
    cc = compiler()
    if cc is None:
        raise FileNotFoundError("the C floor needs a C compiler; install gcc")
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "floor.so"
        subprocess.run([cc, *FLAGS, "-o", library, SOURCE, "-lm"], check=True)
        return ctypes.CDLL(str(library))


def _pointer(values: np.ndarray):
    return values.ctypes.data_as(_DOUBLES)


class CFloor(Simulator):
    """`floor.c` through ctypes, one lane after the other."""

    name = "C by hand"
    settings = "the schedule's nodes"

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self._library = _compiled()

    def solve(self, lane: Lane, inputs: Float[np.ndarray, " input"]) -> np.ndarray:
        return self.sensitivities(lane, inputs)[0]

    def sensitivities(
        self, lane: Lane, inputs: Float[np.ndarray, " input"]
    ) -> tuple[np.ndarray, np.ndarray]:
        size = lane.course.time.size
        rig = np.array(
            [
                lane.radius,
                lane.anchor_x,
                lane.anchor_y,
                lane.base_length,
                lane.heated_fraction,
                lane.room_temperature,
                lane.torque,
                *lane.stops,
            ]
        )
        q, jacobian = np.empty(size), np.empty((size, len(INPUTS)))
        arrays = [np.ascontiguousarray(values, float) for values in lane.course]
        start = np.ascontiguousarray(inputs, float)
        self._library.staircase(
            _pointer(rig),
            _pointer(start),
            ctypes.c_int(lane.intervals),
            *(_pointer(values) for values in arrays),
            _pointer(q),
            _pointer(jacobian),
        )
        return q, jacobian
