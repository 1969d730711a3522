"""Our sampler as the command line runs it, in a process of its own.

python -m benchmarks.samplers.ours SEED OUT writes draws and times; what it compiles is kept in
JAX_COMPILATION_CACHE_DIR, which the caller sets.
"""

import sys
import time
from pathlib import Path

import numpy as np

from benchmarks.problem import posed
from muscle_bayes.inference.sampling.fit import FULL, sample

NAME = "muscle_bayes"
SETTINGS = (
    f"{FULL.chains} chains, {FULL.warmup} iterations of warm-up, rounds of draws until they agree"
)
CACHE = {
    "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
    "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1",
}
"""As the command line sets them."""


def main(seed: int, path: Path) -> None:
    """Pose, sample, write."""
    problem = posed()
    searched = 0.0

    def report(stage: str, done: int, total: int) -> None:
        nonlocal searched
        if stage == "searching" and done == total:
            searched = time.process_time()

    sampled = sample(problem, FULL, seed=seed, report=report)
    busy = time.process_time() - searched
    draws = sampled.draws
    np.savez(
        path,
        busy=busy,
        vector=draws.vector,
        diverging=draws.divergences,
        # Surrogate transitions need no gradient.
        steps=int(np.sum(draws.statistics.get("n_steps", 0))),
        with_inertia=any(lanes.fine is not None for lanes in sampled.problem.data.lanes),
        **{f"seconds_{stage}": value for stage, value in sampled.seconds.items()},
    )


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]))
