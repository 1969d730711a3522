"""Over repeated data sets of the twin, 90 % intervals of J and D cover the truth 90 % of the time."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

from muscle_bayes.data import read_runs
from muscle_bayes.inference.sampling.fit import Effort, fit
from muscle_bayes.twin import save_runs, simulate
from muscle_bayes.twin.shipped import shipped_runs

pytestmark = pytest.mark.slow
SETS = int(os.environ.get("COVERAGE_SETS", "40"))
EFFORT = Effort(chains=2, warmup=150, draws=250, min_ess=50)


@pytest.mark.timeout(7200)
def test_intervals_cover_nominally(tmp_path: Path) -> None:
    plan = [(name, *rest) for name, rest in shipped_runs().items() if name.startswith("spring")]
    inside: dict[str, list[bool]] = {"J": [], "D": []}
    for number in range(SETS):
        folder = tmp_path / str(number)
        runs = {
            name: simulate(rig, protocol, (77, number, index))
            for index, (name, rig, protocol) in enumerate(plan)
        }
        save_runs(folder, runs)
        posterior = fit(read_runs([folder]), effort=EFFORT, seed=number)
        truth = {"J": 0.00124103, "D": 0.0054594}
        for name, hits in inside.items():
            low, high = np.quantile(posterior.tree["posterior"][name].to_numpy(), [0.05, 0.95])
            hits.append(bool(low <= truth[name] <= high))
        print(
            number, {name: f"{sum(hits)}/{len(hits)}" for name, hits in inside.items()}, flush=True
        )
    for name, hits in inside.items():
        chance = 2 * min(binom.cdf(sum(hits), SETS, 0.9), binom.sf(sum(hits) - 1, SETS, 0.9))
        assert chance > 0.01, f"{name}: {sum(hits)} of {SETS} intervals cover"
