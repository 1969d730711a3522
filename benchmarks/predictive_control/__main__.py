"""Predictive control beside the laws, on the same new joints: writes docs/predictive-control.md."""

import argparse
import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.predictive_control.many import each
from benchmarks.predictive_control.page import Comparison, page
from muscle_bayes.compiled import keep_compiled_code
from muscle_bayes.control.judging.metrics import Metrics
from muscle_bayes.control.judging.specification import Specification

DOCS = Path(__file__).parents[2] / "docs" / "predictive-control.md"
POINT = "pi-point"
"""The law of the comparison that is tuned on one specimen's median joint."""


def stated(told: dict[str, Any]) -> dict[str, Specification]:
    """The specifications of control.json."""
    return {
        name: Specification(
            spec["limits"],
            {k: np.inf if v is None else v for k, v in spec["feasible"].items()},
            spec["infeasible"],
            spec["attainable"],
        )
        for name, spec in told["specifications"].items()
    }


def compared(args: argparse.Namespace) -> Comparison:
    """Predictive control, the recommended law, point gains and the best input on the same joints."""
    from muscle_bayes.control.batch import Bank, run
    from muscle_bayes.control.judging.feasible import feasible
    from muscle_bayes.control.laws.gains import law_of, read_gains
    from muscle_bayes.control.plant.draws import joint_draws
    from muscle_bayes.control.plant.heater_fit import assumed_heater, fit_heater
    from muscle_bayes.control.scenarios.thesis import thesis_scenarios
    from muscle_bayes.data import read_runs
    from muscle_bayes.inference.population import load_population

    told = json.loads((args.laws / "control.json").read_text(encoding="utf-8"))
    population, notes = load_population(args.muscle)
    heater = fit_heater(read_runs(args.heater)) if args.heater else assumed_heater()
    drawn = joint_draws(population, heater.draws, args.draws + told["draws"])
    first, others = drawn.split(args.draws)
    # The seeds of all the laws' joints, of which these are the first.
    joints, seeds = others.take(slice(0, args.joints)), Bank(others, seed=1).seeds()
    scenarios, bank = thesis_scenarios(), Bank(joints, seed=1)
    law = told["recommended"]
    columns = {}
    rows = list(each(joints, first.median(), seeds, args.workers))
    columns["predictive"] = {
        s.name: Metrics(*map(np.array, zip(*(found[s.name] for found, _ in rows), strict=True)))
        for s in scenarios
    }
    for name in dict.fromkeys((law, POINT)):
        gains = law_of(read_gains(args.laws / f"gains-{name}.toml"), drawn.design)
        columns[name] = {s.name: run(bank, gains, s).metrics for s in scenarios}
    best = feasible(joints, scenarios, joints=len(joints))
    seconds = np.concatenate([taken for _, taken in rows])
    return Comparison(columns, best, stated(told), law, len(joints), tuple(notes), seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("muscle", type=Path, help="posterior, as for scripts/control_results.py")
    parser.add_argument("--heater", type=Path, action="append")
    parser.add_argument("--laws", type=Path, default=Path("reports/control"))
    parser.add_argument("--draws", type=int, default=96, help="joints that the laws were tuned on")
    parser.add_argument("--joints", type=int, default=48, help="new joints, the laws' first")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--out", type=Path, default=DOCS)
    args = parser.parse_args()
    keep_compiled_code()
    heaters = "".join(f" --heater {path}" for path in args.heater or ())
    command = (
        f"python -m benchmarks.predictive_control {args.muscle.name}{heaters} --draws {args.draws} "
        f"--joints {args.joints}"
    )
    args.out.write_text(page(compared(args), command), encoding="utf-8")


if __name__ == "__main__":
    main()
