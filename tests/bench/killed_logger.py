"""Loggers that are killed: forks one a trial, counts what it is given to write, kills it.

    python killed_logger.py FOLDER TRIALS SEED

Prints one JSON object a trial: its folder, and the rows that the logger had begun to write.
"""

import json
import mmap
import os
import signal
import struct
import sys
import time
from pathlib import Path

import numpy as np
from fake_bench import RIG, FakeBench

from muscle_bayes.bench.recording.rows import RowWriter
from muscle_bayes.bench.recording.run_file import RunFile
from muscle_bayes.bench.recording.session import Session
from muscle_bayes.bench.sequences.sequence import Repeat, RunPlan, Sequence, Stage

LOADS = tuple(
    Stage(setpoint_a=60.0, duration=0.2, load=load, note="often, so that kills meet the change")
    for load in (0.15, 0.16)
)
SEQUENCE = Sequence(
    load=0.1,
    run=(RunPlan(name="killed", load=0.1, stage=(Repeat(repeat=1000, stages=LOADS),)),),
)


def log(folder: Path, counter: mmap.mmap) -> None:
    """Record for ever on a fake bench; rows begun and load changes begun go into shared memory."""
    begun = [0, 0]
    write, change = RowWriter.write, RunFile.change_load

    def counted_write(self: RowWriter, sample, causes) -> None:
        begun[0] += 1
        counter[:16] = struct.pack("qq", *begun)
        write(self, sample, causes)

    def counted_change(self: RunFile, *arguments: float) -> None:
        begun[1] += 1
        counter[:16] = struct.pack("qq", *begun)
        change(self, *arguments)

    RowWriter.write, RunFile.change_load = counted_write, counted_change
    bench = FakeBench()
    bench.operator.delay = 0.05
    session = Session(
        SEQUENCE, folder / "s.toml", folder, bench.devices(), bench.operator, rig=RIG, load=0.1
    )
    session.devices.open()
    list(session.record())


def main(root: Path, trials: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    for number in range(trials):
        folder = root / f"trial-{number:03d}"
        counter = mmap.mmap(-1, 16)
        # Half of the kills within the first moments, where files come into being.
        delay = float(rng.exponential(0.03) if number % 2 else rng.uniform(0.0, 0.6))
        child = os.fork()
        if child == 0:
            try:
                log(folder, counter)
            finally:
                os._exit(1)
        time.sleep(delay)
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        rows, changes = struct.unpack("qq", counter[:16])
        killed = os.WIFSIGNALED(status)
        told = {"folder": str(folder), "rows": rows, "changes": changes, "killed": killed}
        print(json.dumps(told), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
