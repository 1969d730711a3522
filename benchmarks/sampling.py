"""Draws from the joint posterior of three staircases, by all samplers in one run.

python -m benchmarks.sampling [CAP [NAME ...]] writes results/sampling.json beside this file. CAP is how
many seconds each sampler that is not ours draws for; names choose some, and keep what others gave.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import jax
import numpy as np
from jaxtyping import Float

from benchmarks import RESULTS
from benchmarks.judging import HARDLY_KNOWN, LARGEST_RHAT, Quality, identified, judge, kept
from benchmarks.machine import machine
from benchmarks.problem import posed
from benchmarks.samplers.chain import WAYS, kind_of
from benchmarks.samplers.ours import CACHE, NAME, SETTINGS
from benchmarks.samplers.protocol import Frame, Sampler, our_density
from benchmarks.timing import seconds
from muscle_bayes.inference.model.problem import Problem
from muscle_bayes.inference.sampling.fit import FULL
from muscle_bayes.inference.search.mode import find_mode

PACKAGES = (
    *("jax", "numpyro", "diffrax", "casadi", "pymc", "nutpie", "pystan", "httpstan", "emcee"),
    *("pints", "arviz"),
)
CAP = 120.0
"""How long each sampler but ours draws [s], its compilation not counted."""
PROCESSES = 2
"""That share a sampler's chains or ensembles, as many as our sampler has threads."""
STARTS = 96
CHECKED = 4
"""Starts at which a sampler's density is compared with ours."""
DENSITY_LIMIT = 5.0
"""Greatest `density_off` of a sampler that is compared. Solutions that err by hundredths of a count bend
the posterior by about that; who samples a slightly other density has it no harder."""
FURTHEST = 2.0
"""How far below the mode's a start's log density may be, per unknown; half is usual of a normal density."""
PATIENCE = 300.0
"""Longest time to compile [s]."""


@dataclass
class Entry:
    """One sampler's draws."""

    sampler: str
    settings: str
    seconds: float
    """Of warm-up and draws."""
    busy: float
    """Processor time of the same, all processes together [s]: tells what a shared machine hides."""
    setup: float
    """Of importing and compiling, before `seconds`."""
    evaluations: int
    """Of gradients (gradient-free samplers: of values) in all processes, warm-up included; NumPyro and Stan
    do not tell those of the transition that the cap cuts off, ours not the values for its slices."""
    diverging: int
    """Draws that diverged after warm-up; -1 where the sampler does not tell."""
    density_off: float
    """Greatest difference of log posteriors from ours at the starts, the mean difference taken off: a
    constant changes no draws."""
    call: float
    """How long its log posterior, for solvers with the gradient, takes alone [s]."""
    quality: Quality
    failure: str = ""

    def row(self) -> dict:
        """For JSON."""
        return asdict(self) | {"verdict": self.quality.verdict}


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _frame(problem: Problem) -> Frame:
    """Coordinates from the mode and the Fisher information there, and points dispersed in them.

    A point of so low a density that no draw would be there is left out.
    """
    mode = find_mode(jax.random.key(0), problem.layout, problem.data)
    vector, information = np.asarray(mode.vector), np.asarray(mode.information)
    covariance = np.linalg.inv(information)
    factor = np.linalg.cholesky(0.5 * (covariance + covariance.T))
    density, rng = our_density(problem), np.random.default_rng(1)
    frame = Frame(vector, factor, np.empty((0, vector.size)))
    starts: list[np.ndarray] = []
    least = -mode.potential - FURTHEST * vector.size
    while len(starts) < STARTS:
        z = rng.standard_normal(vector.size)
        if density(frame.vector(z)) > least:
            starts.append(z)
    return frame._replace(starts=np.array(starts))


def _environment(cache: Path) -> dict[str, str]:
    return os.environ | CACHE | {"JAX_COMPILATION_CACHE_DIR": str(cache), "OMP_NUM_THREADS": "1"}


def _ours(folder: Path, problem: Problem) -> dict:
    """Our sampler from cold start and warm, each in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.samplers.ours"]
    environment = _environment(folder / "cache")
    walls = {}
    for start in ("cold", "warm"):
        path = folder / f"{start}.npz"
        begun = time.perf_counter()
        subprocess.run([*command, "1", str(path)], env=environment, check=True)
        walls[start] = time.perf_counter() - begun
        _say(f"{NAME}, {start}: {walls[start]:.1f} s")
    with np.load(path) as stored:
        quality = judge(stored["vector"], identified(problem.layout))
        stages = {
            name.removeprefix("seconds_"): float(stored[name])
            for name in stored.files
            if name.startswith("seconds_")
        }
        busy = float(stored["busy"])
        # Each leapfrog step needs one; those of the warm-up are taken for as many as later ones.
        gradients = int(stored["steps"]) * (1.0 + FULL.warmup / quality.draws)
        diverging = int(stored["diverging"])
        if stored["with_inertia"]:
            raise ValueError("ours solved these staircases with inertia: another posterior")
    begun_by = walls["warm"] - stages["sampling"]
    entry = Entry(
        NAME,
        SETTINGS,
        stages["sampling"],
        busy,
        begun_by,
        round(gradients),
        diverging,
        0.0,
        0.0,
        quality,
    )
    return entry.row() | {"walls": walls, "stages": stages}


def _density_off(
    name: str, problem: Problem, frame: Frame
) -> tuple[float, float, str, type[Sampler]]:
    """`Entry.density_off` and `Entry.call`, the settings and the class of a sampler."""
    kind = kind_of(name)
    sampler, density = kind(problem, frame), our_density(problem)
    points = frame.vector(frame.starts[:CHECKED])
    off = np.array([sampler.density(point) - density(point) for point in points])
    call = seconds(lambda: sampler.density(points[0]))
    return float(np.abs(off - off.mean()).max()), call, sampler.settings, kind


def _drawn(name: str, cap: float, folder: Path) -> list[dict[str, np.ndarray]]:
    """What each process of a sampler has left."""
    paths = [folder / f"{name}-{index}.npz" for index in range(PROCESSES)]
    running = [
        subprocess.Popen(
            [
                *(sys.executable, "-m", "benchmarks.samplers.chain", name, str(index), str(cap)),
                *(str(folder / "frame.npz"), str(path)),
            ],
            env=_environment(folder / "cache"),
            stdout=sys.stderr,
        )
        for index, path in enumerate(paths)
    ]
    for one in running:
        try:
            one.wait(cap + PATIENCE)
        except subprocess.TimeoutExpired:
            one.kill()
    loaded = []
    for path in paths:
        if not path.exists():
            raise RuntimeError(f"{name} left no draws; what it said is above")
        with np.load(path) as stored:
            loaded.append({key: stored[key] for key in stored.files})
    return loaded


def _other(name: str, cap: float, folder: Path, problem: Problem, frame: Frame) -> dict:
    """A sampler that is not ours, its density checked first."""
    off, call, settings, kind = _density_off(name, problem, frame)
    _say(f"{kind.name}: log posterior off by {off:.2g}")
    parts = _drawn(name, cap, folder)
    chains = []
    for part in parts:
        z = part["z"].reshape(len(part["z"]), kind.walkers, frame.mode.size)
        chains.append(kept(z, part["tuning"]))
    shortest = min(len(chain) for chain in chains)
    draws = np.concatenate([chain[-shortest:] if shortest else chain[:0] for chain in chains], 1)
    vectors: Float[np.ndarray, "chain draw n"] = frame.vector(draws.swapaxes(0, 1))
    told = all(int(part["diverging"]) >= 0 for part in parts)
    entry = Entry(
        kind.name,
        settings,
        float(max(part["seconds"] for part in parts)),
        float(sum(part["busy"] for part in parts)),
        float(max(part["setup"] for part in parts)),
        int(sum(part["evaluations"] for part in parts)),
        int(sum(part["diverging"] for part in parts)) if told else -1,
        off,
        call,
        judge(vectors, identified(problem.layout)),
    )
    if not off <= DENSITY_LIMIT:
        entry.failure = "log posterior differs"
    return entry.row()


def run(cap: float, chosen: tuple[str, ...], path: Path) -> None:
    """Every chosen sampler; what is not chosen keeps its earlier result. Written after each."""
    problem, load = posed(), os.getloadavg()[0]
    entries = {}
    if path.exists() and set(chosen) != {"ours", *WAYS}:
        entries = json.loads(path.read_text(encoding="utf-8"))["entries"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _say("searching the mode")
        frame = _frame(problem)
        frame.save(folder / "frame.npz")
        for one in chosen:
            try:
                entries[one] = (
                    _ours(folder, problem)
                    if one == "ours"
                    else _other(one, cap, folder, problem, frame)
                )
                _say(f"{one}: {entries[one]}")
            except (ImportError, RuntimeError) as trouble:
                entries[one] = {"sampler": one, "failure": str(trouble)}
                _say(f"{one}: {trouble}")
            results = {
                "machine": machine(PACKAGES),
                "load": load,
                "cap": cap,
                "processes": PROCESSES,
                "unknowns": int(frame.mode.size),
                "hardly_known": HARDLY_KNOWN,
                "largest_rhat": LARGEST_RHAT,
                "entries": {one: entries[one] for one in ("ours", *WAYS) if one in entries},
            }
            path.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


def main(arguments: list[str]) -> None:
    """Run, and write the results."""
    cap = float(arguments[0]) if arguments else CAP
    chosen = tuple(arguments[1:]) or ("ours", *WAYS)
    RESULTS.mkdir(exist_ok=True)
    with jax.enable_x64(True):
        run(cap, chosen, RESULTS / "sampling.json")


if __name__ == "__main__":
    main(sys.argv[1:])
