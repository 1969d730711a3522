"""A candidate whose first descents end at poor local maxima."""

from pathlib import Path

import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.discovery.discover import applicable
from muscle_bayes.discovery.nominal import nest, nominal
from muscle_bayes.discovery.search import finished, first_steps, screen, started_again
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.search.descent import descend
from muscle_bayes.trial.cases import Case, data_set
from muscle_bayes.twin import save_runs

EFFECT = "coil-contact"


@pytest.mark.slow
@double_precision
def test_new_draws_beside_its_own_parameters_find_the_best(tmp_path: Path) -> None:
    """Some first searches end more than 30 nat below the best; so may new draws, but not all."""
    save_runs(tmp_path / "runs", data_set(Case("single", (EFFECT,), 0)))
    runs = read_runs([tmp_path / "runs"])
    assert EFFECT in applicable(runs, ())
    whole, point = nest(nominal(runs, "coulomb", (), 0), [EFFECT])
    base = descend(whole, (), point)
    starts = [screen(whole, base, [EFFECT], seed)[EFFECT] for seed in range(4)]
    begun = [first_steps(whole, base, EFFECT, some) for some in starts]
    first = [finished(whole, base, steps) for steps in begun if steps]
    poor = min(first, key=lambda one: one.log_evidence)
    again = [started_again(whole, base, poor, seed).log_evidence for seed in range(3)]
    best = max(*again, *(one.log_evidence for one in first))
    assert poor.log_evidence < best - 30.0
    assert min(again) >= poor.log_evidence
    assert max(again) > best - 3.0
