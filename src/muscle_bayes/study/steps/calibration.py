"""Slow checks of the method itself: their results where somebody has run them."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from muscle_bayes.criticism.sbc import Calibration
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.json_file import write_json
from muscle_bayes.progress import Report
from muscle_bayes.report.calibration_figure import POINTWISE, calibration_figure
from muscle_bayes.report.trial_figure import trial_figure
from muscle_bayes.study.plan import Plan
from muscle_bayes.study.steps.figures import Drawn

SYNTHETIC = "synthetic"


def make(plan: Plan, name: str, report: Report) -> None:
    """Write results/calibration.json: `sbc` by name, and `trial`, `gradient`, `sampling` where they are."""
    drawn, sbc, others = Drawn(plan), {}, {}
    for path in plan.calibrations:
        numbers = _read(path)
        if path.name == "calibration.json":
            sbc[path.parent.name] = _withoutranks_of(numbers)
            drawn.add(
                f"sbc-{path.parent.name}",
                calibration_figure(ranks_of(numbers), path.parent.name),
                f"Calibration of the {path.parent.name}'s posterior, a panel a quantity. A calibrated "
                f"quantity stays in the grey band, at each rank with probability {POINTWISE:.0%}.",
                SYNTHETIC,
            )
            continue
        others[path.stem] = numbers
        if path.name == "trial.json":
            drawn.add(
                "trial",
                trial_figure(numbers),
                "Effects hidden in runs of random rigs. Above: the first answer to each. Below: how often "
                "answers of a given probability were right.",
                SYNTHETIC,
            )
    write_json(plan.result(name), {"sbc": sbc, **others, "figures": drawn.listed})


def _read(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError) as error:
        raise MuscleBayesError(
            f"{path}: cannot be read as a result ({error}). Fix: run the check again, or remove the file."
        ) from None


def _withoutranks_of(numbers: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in numbers.items() if key not in ("ranks", "p")} | {
        "quantities": len(numbers["p"])
    }


def ranks_of(numbers: dict[str, Any]) -> Calibration:
    """The calibration that a file tells of."""
    ranks = {name: np.array(one) for name, one in numbers["ranks"].items()}
    return Calibration(numbers["source"], ranks, numbers["converged"], numbers["processor_seconds"])
