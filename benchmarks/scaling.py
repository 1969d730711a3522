"""How cost grows with what is fitted: record length, runs, muscles, draws, workers.

python -m benchmarks.scaling writes results/scaling.json beside this file.
"""

import dataclasses
import json
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks import RESULTS
from benchmarks.machine import machine
from benchmarks.problem import DATA, STAIRCASES
from benchmarks.timing import timings
from muscle_bayes.criticism.sbc import Template, rank_data_set
from muscle_bayes.data import read_runs
from muscle_bayes.data.run import Run
from muscle_bayes.inference.model.density import potential
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.posteriors.predict import predict
from muscle_bayes.inference.running.programs import constrained
from muscle_bayes.inference.search.mode import find_mode
from muscle_bayes.parallel.tasks import Tasks, run_tasks

PACKAGES = ("jax", "jaxlib", "diffrax", "numpyro", "distributed", "numpy")
SHARES = (0.125, 0.25, 0.5, 1.0)
"""Of the staircases' records."""
RUNS = (1, 2, 3, 6, 9)
DRAWS = (25, 50, 100, 200)
WORKERS = (1, 2)
FITS = 4
"""Independent fits that workers share."""

_gradient = jax.jit(jax.value_and_grad(potential), static_argnames="layout")


def _gradient_call(runs: Sequence[Run]) -> tuple[Callable[[], object], int]:
    """One value and gradient near the mode, and on how many intervals."""
    problem = pose(runs)
    vector = find_mode(jax.random.key(0), problem.layout, problem.data).vector
    intervals = sum(int((np.asarray(lanes.weight) > 0).sum()) for lanes in problem.data.lanes)

    def call() -> object:
        return jax.block_until_ready(_gradient(vector, problem.layout, problem.data))

    return call, intervals


def _renamed(run: Run, number: int) -> Run:
    return dataclasses.replace(run, name=f"{run.name}-{number}")


def _with_second_muscle(run: Run) -> Run:
    """The run as if the same muscle pulled on the other side too."""
    metadata, fixture = run.metadata, run.metadata.fixture
    sides = {
        f"{key}_b": getattr(fixture, f"{key}_a") for key in ("rotor_radius", "anchor_x", "anchor_y")
    }
    both = metadata.model_copy(
        update={"fixture": fixture.model_copy(update=sides), "element_b": metadata.element_a}
    )
    return dataclasses.replace(run, metadata=both)


def _gradients(kinds: dict[float, Sequence[Run]], report: str) -> list[dict[str, Any]]:
    calls, sizes = {}, {}
    for size, runs in kinds.items():
        calls[str(size)], sizes[str(size)] = _gradient_call(runs)
        print(f"{report}: {size}", file=sys.stderr, flush=True)
    return [
        {"size": float(size), "seconds": timing.median, "intervals": sizes[size]}
        for size, timing in timings(calls).items()
    ]


def _predictions(runs: Sequence[Run]) -> list[dict[str, Any]]:
    """Predictive draws of all runs."""
    problem = pose(runs)
    mode = find_mode(jax.random.key(0), problem.layout, problem.data)
    calls = {}
    for count in DRAWS:
        vectors = jnp.repeat(mode.vector[None], count, axis=0)
        draws = constrained(vectors, problem.layout, problem.data)
        calls[str(count)] = lambda draws=draws: predict(problem, draws, 0)
    return [{"size": float(n), "seconds": t.median} for n, t in timings(calls).items()]


def _fits(workers: int) -> float:
    """Wall time of FITS fixture fits, the workers warm."""
    template = Template(tuple(DATA / f"spring-{number}.csv" for number in (1, 3)))
    arguments = {f"fit-{seed}": (template, seed) for seed in range(FITS)}
    with tempfile.TemporaryDirectory() as folder:
        begun = time.perf_counter()
        run_tasks(Tasks(rank_data_set, arguments, {}), Path(folder), workers=workers)
        return time.perf_counter() - begun


def run() -> dict[str, Any]:
    """Everything that is measured."""
    staircases = read_runs([DATA / f"{name}.csv" for name in STAIRCASES])
    longest = staircases[0].duration
    many = [_renamed(run, number) for number in range(3) for run in staircases]
    found = {
        "length": _gradients(
            {
                share * longest: [run.until(share * longest) for run in staircases]
                for share in SHARES
            },
            "record length",
        ),
        "runs": _gradients({count: many[:count] for count in RUNS}, "runs"),
        "muscles": _gradients(
            {1: staircases, 2: [_with_second_muscle(run) for run in staircases]}, "muscles"
        ),
        "draws": _predictions(staircases),
        "workers": [{"size": float(n), "seconds": _fits(n)} for n in WORKERS],
    }
    return {"machine": machine(PACKAGES), "fits": FITS, "scaling": found}


def main() -> None:
    """Run, and write the results."""
    RESULTS.mkdir(exist_ok=True)
    with jax.enable_x64(True):
        results = run()
    (RESULTS / "scaling.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
