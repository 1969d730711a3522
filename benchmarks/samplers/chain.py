"""One process of one sampler: python -m benchmarks.samplers.chain NAME INDEX CAP FRAME OUT."""

import importlib
import sys
from pathlib import Path

import jax

from benchmarks.problem import posed
from benchmarks.samplers.protocol import Frame, Record, Sampler

WAYS = {
    "numpyro_diffrax": ("numpyro_nuts", "NumpyroDiffrax"),
    "pymc_casadi": ("pymc_casadi", "PymcCasadi"),
    "nutpie_casadi": ("nutpie_casadi", "NutpieCasadi"),
    "stan": ("stan", "Stan"),
    "emcee_cvodes": ("emcee_moves", "EmceeCvodes"),
    "pints_cvodes": ("pints_metropolis", "PintsCvodes"),
    "emcee_floor": ("emcee_moves", "EmceeFloor"),
    "pints_floor": ("pints_metropolis", "PintsFloor"),
    "numpyro_ours": ("numpyro_nuts", "NumpyroOurs"),
}
"""Module and class of each sampler; a module is imported only where its packages are needed."""


def kind_of(name: str) -> type[Sampler]:
    """A sampler's class."""
    module, kind = WAYS[name]
    return getattr(importlib.import_module(f"benchmarks.samplers.{module}"), kind)


def main(name: str, index: int, cap: float, frame: Path, path: Path) -> None:
    """Draw for `cap` seconds once everything is compiled."""
    with jax.enable_x64(True):
        record = Record(path, cap)
        known = Frame.load(frame)
        sampler = kind_of(name)(posed(), known)
        first = index * sampler.walkers
        sampler.run(known.starts[first : first + sampler.walkers], index + 1, record)
        record.end()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), Path(sys.argv[4]), Path(sys.argv[5]))
