"""What surrogate transitions buy beside NUTS: effective sample size per CPU-second.

`python -m benchmarks.kernels` draws the posteriors of the shipped springs and staircases by both, from one
mode and with compiled code, and prints a table. The minimum forces are sliced by both alike.
"""

import time

import arviz as az
import jax
import numpy as np

import muscle_bayes as mb
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.sampling.gibbs_blocks import blocks_of
from muscle_bayes.inference.sampling.kernels import LinearisedSteps, Nuts, Sampler
from muscle_bayes.inference.sampling.sampler import Effort, draw
from muscle_bayes.inference.search.mode import find_mode

KERNELS: dict[str, Sampler] = {"surrogate transitions": LinearisedSteps(), "NUTS": Nuts()}
COLUMNS = (
    "runs",
    "kernel",
    "CPU ms a draw",
    "least ESS, smooth",
    "least ESS, others",
    "ESS per CPU-s",
)


@double_precision
def rows(runs: str, draws: int = 200) -> list[tuple[str, ...]]:
    """A row of the table for each kernel."""
    problem = pose(mb.load_example(runs))
    mode = find_mode(jax.random.key(0), problem.layout, problem.data)
    names = np.repeat(
        [name for name, _ in problem.layout.shapes],
        [int(np.prod(shape)) for _, shape in problem.layout.shapes],
    )
    smooth = np.isin(names, blocks_of(list(names)).smooth)
    found = []
    for kernel, block in KERNELS.items():
        effort = Effort(warmup=50, draws=draws, rounds=0, sampler=block)
        for _ in range(2):  # the second time without compiling
            begun = time.process_time()
            drawn = draw(jax.random.key(1), mode, problem, effort)
            busy = time.process_time() - begun
        ess = np.asarray(az.ess(az.convert_to_datatree({"v": drawn.values}).posterior)["v"])
        share = draws / (draws + effort.warmup)
        each = 1e3 * busy / (effort.chains * (draws + effort.warmup))
        least = ess[smooth].min(), ess[~smooth].min(), ess.min() / (busy * share)
        found.append((runs, kernel, f"{each:.1f}", *(f"{x:.0f}" for x in least)))
    return found


def main() -> None:
    """Print the table."""
    lines = [COLUMNS, ("---",) * len(COLUMNS), *rows("springs"), *rows("staircases")]
    print("\n".join(f"| {' | '.join(line)} |" for line in lines))


if __name__ == "__main__":
    main()
