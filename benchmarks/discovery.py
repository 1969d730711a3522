"""Discovery against other ways to select an effect, on the same cases of a trial.

    python -m benchmarks.discovery reports/trial/outcomes.json

BIC: of the same fits, the candidate (or none) with the least Bayesian information criterion; the first step
of stepwise selection. PySINDy: sequentially thresholded least squares of the nominal model's misfit on the
effects' signatures, threshold by BIC; the effect with the largest coefficient. Both get exactly what
`discover` had at its first step. Writes benchmarks/results/discovery.json.
"""

import argparse
import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import eigh

from muscle_bayes.discovery.naming import NONE
from muscle_bayes.trial.counts import DETECTABLE, Rate

RESULT = Path(__file__).parent / "results" / "discovery.json"
THRESHOLDS = np.geomspace(0.1, 300.0, 40)
"""Of a coefficient of a signature of unit length, in standard deviations of the noise."""


def by_bic(outcome: Mapping[str, Any]) -> str:
    """The candidate with the least criterion."""
    return min(outcome["bic"], key=lambda name: outcome["bic"][name])


def by_sparse_regression(outcome: Mapping[str, Any]) -> str:
    """The effect with the largest coefficient in the regression that its own BIC prefers."""
    import pysindy

    found = outcome["regression"]
    # Any X with this X'X, and y with this X'y, has the same least squares: X'X = V S V'.
    scales, vectors = eigh(np.array(found["gram"]))
    kept = scales > 1e-9 * scales.max()
    root = np.sqrt(scales[kept])
    x = root[:, None] * vectors[:, kept].T
    y = (vectors[:, kept].T @ np.array(found["projection"])) / root
    beyond = found["total"] - y @ y
    best = (found["errors"] * np.log(found["total"] / found["errors"]), np.zeros(x.shape[1]))
    for threshold in THRESHOLDS:
        model = pysindy.STLSQ(threshold=float(threshold), alpha=1e-6)
        try:
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", "Sparsity parameter is too big", UserWarning)
                model.fit(x, y[:, None])
        except ValueError:  # every coefficient was thresholded away
            continue
        coefficients = np.asarray(model.coef_).ravel()
        squares = float(np.sum((y - x @ coefficients) ** 2) + beyond)
        size = np.count_nonzero(coefficients)
        score = found["errors"] * np.log(squares / found["errors"]) + size * np.log(found["errors"])
        if score < best[0]:
            best = (score, coefficients)
    chosen = best[1]
    return found["effects"][int(np.argmax(np.abs(chosen)))] if chosen.any() else NONE


METHODS = {
    "discover": lambda outcome: outcome["verdict"][0],
    "BIC, stepwise": by_bic,
    "PySINDy (STLSQ)": by_sparse_regression,
}


def compared(outcomes: list[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """A row for every method: hidden effects named first, and claims where nothing is hidden."""
    single = [o for o in outcomes if o["kind"] == "single" and o["excess"] >= DETECTABLE]
    none = [o for o in outcomes if o["kind"] == "none"]
    rows = []
    for name, method in METHODS.items():
        named = Rate.of("named", "", [method(one) in one["hidden"] for one in single])
        claimed = Rate.of("claimed", "", [method(one) != NONE for one in none])
        rows.append(
            {
                "method": name,
                "named": [named.hits, named.cases, named.low, named.high],
                "false_claims": [claimed.hits, claimed.cases, claimed.low, claimed.high],
            }
        )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("outcomes", type=Path)
    args = parser.parse_args()
    rows = compared(json.loads(args.outcomes.read_text())["outcomes"])
    RESULT.write_text(json.dumps(rows, indent=1) + "\n")
    for row in rows:
        print(row)


if __name__ == "__main__":
    main()
