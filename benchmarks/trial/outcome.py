"""One case of a trial: made, searched blind, and judged."""

import tempfile
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.trial.cases import Case, write_runs
from benchmarks.trial.outside import OUTSIDE
from muscle_bayes.compiled import forget_much_compiled_code
from muscle_bayes.data import read_runs
from muscle_bayes.data.run import Run
from muscle_bayes.discovery.discover import applicable, discover
from muscle_bayes.discovery.locate import MisfitMap
from muscle_bayes.discovery.nominal import noise_of_reading
from muscle_bayes.discovery.result import Discovery, Judged
from muscle_bayes.parallel.tasks import Tasks
from muscle_bayes.physics.effects import CATALOGUE, effect_type
from muscle_bayes.provenance import LIBRARIES, code_checksum


def run_case(case: Case) -> dict[str, Any]:
    """Make the case's runs, search them by what their files say alone, and say what came out."""
    with tempfile.TemporaryDirectory() as folder:
        write_runs(case, Path(folder))
        runs = read_runs([Path(folder)])
        found = discover(
            runs,
            hold_out=[case.held_out],
            candidates=applicable(runs, (), CATALOGUE),
            seed=case.seed,
            workers=1,
        )
    forget_much_compiled_code()
    noise = error_of_reading(runs)
    verdict = found.verdict
    return {
        "kind": case.kind,
        "hidden": list(case.hidden),
        "port": OUTSIDE[case.hidden[0]].port if case.kind == "outside" else None,
        "seed": case.seed,
        "rig": case.rig,
        "verdict": [verdict] if isinstance(verdict, str) else list(verdict),
        "probabilities": dict(found.probabilities),
        "tie": list(found.steps[0].tie) if found.steps else [],
        "ports": [step.port for step in found.steps],
        "tied_ports": sorted({effect_type(one).port for step in found.steps for one in step.tie}),
        "gates": [[step.gate.gain, step.gate.se, step.gate.by] for step in found.steps],
        "stopped_because": found.stopped_because,
        "excess": excess(found.located, found.floor, noise),
        "excess_left": [excess(step.after.misfit, found.floor, noise) for step in found.steps],
        "held_out": held_out_ratio(found.final, noise, found, case.held_out),
        "bic": dict(found.naming.bic),
        "misfit_p_value": found.located.p_value,
        "left_p_value": found.final.misfit.p_value,
    }


def error_of_reading(runs: Sequence[Run]) -> float:
    """RMS error of one reading, noise and rounding [the log's unit], of runs logged by one sensor."""
    noise = np.median([noise_of_reading(run) for run in runs])
    return float(np.sqrt(noise**2 + runs[0].output_sensor.resolution ** 2 / 12.0))


def excess(misfit: MisfitMap, floor: Mapping[str, float], noise: float) -> float:
    """Largest misfit of a model in any fitted run, above the noise of means (`floor`), in the error
    of a reading: at least 0.5 counts as detectable.

    What the noise of a run's n means may leave by chance, two standard errors of their mean square,
    is no misfit: floor^2 (1 + 2 sqrt(2 / n)) is taken off.
    """
    ratios = []
    for line in misfit.traces:
        chance = floor[line.run] ** 2 * (1.0 + 2.0 * np.sqrt(2.0 / line.residual.size))
        above = max(float(np.mean(line.residual**2)) - chance, 0.0)
        ratios.append(np.sqrt(above) / noise)
    return float(max(ratios))


def held_out_ratio(judged: Judged, noise: float, found: Discovery, run: str) -> float:
    """RMSE of single held-out readings over their own error.

    Means of many readings show the model's error e alone; of a single one it is sqrt(noise^2 + e^2).
    """
    error = max(judged.checks[run].rmse ** 2 - found.floor[run] ** 2, 0.0)
    return float(np.sqrt(noise**2 + error) / noise)


def trial_tasks(chosen: list[Case]) -> Tasks:
    """A task for each case; kept results count only for the same code and libraries."""
    package = ("muscle_bayes.discovery.discover", "muscle_bayes.twin")
    here = ("cases", "other_rigs", "outcome", "outside", "random_rigs")
    inputs = {
        "code": [code_checksum(name) for name in package],
        "trial": [Path(__file__).with_name(f"{name}.py").read_text() for name in here],
        **{name: version(name) for name in LIBRARIES},
    }
    return Tasks(run_case, {case.name: (case,) for case in chosen}, inputs)
