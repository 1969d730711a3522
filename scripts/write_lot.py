"""Synthetic lot of eight specimens: one staircase each of muscles that differ; writes data/lot."""

import argparse
import dataclasses
from pathlib import Path

import numpy as np

from muscle_bayes.twin import protocols
from muscle_bayes.twin.plant.parameters import MuscleParameters, Truth
from muscle_bayes.twin.plant.rig import Rig
from muscle_bayes.twin.simulate import simulate
from muscle_bayes.twin.storage import save_runs

SCALED = ("A", "B", "F_hyst_min", "K_hyst", "F_modulus_min", "K_modulus", "H")
"""Of Table 2; the rest of it is the same in all specimens."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("data/lot"))
    parser.add_argument("--spread", type=float, default=0.08, help="relative, of every constant")
    parser.add_argument("--count", type=int, default=8)
    parser.add_argument("--seed", type=int, default=2026)
    args = parser.parse_args()
    generator = np.random.default_rng(args.seed)
    table = MuscleParameters()
    for number in range(1, args.count + 1):
        factors = np.exp(args.spread * generator.standard_normal(len(SCALED)))
        own = {k: float(f * getattr(table, k)) for k, f in zip(SCALED, factors, strict=True)}
        rig = Rig(truth=Truth(muscle_a=dataclasses.replace(table, **own)))
        protocol = dataclasses.replace(protocols.staircase(0.166), log_period=1.0)
        folder, name = args.out / f"m{number}", f"staircase-m{number}"
        folder.mkdir(parents=True, exist_ok=True)
        save_runs(folder, {name: simulate(rig, protocol, (args.seed, number))})
        path = folder / f"{name}.toml"
        head, found, tail = path.read_text(encoding="utf-8").partition("[element_a]\n")
        assert found
        path.write_text(f'{head}{found}specimen = "m{number}"\n{tail}', encoding="utf-8")


if __name__ == "__main__":
    main()
