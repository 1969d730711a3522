"""Draws in which a run cannot be solved: left out while they are few, an error where they are many."""

import numpy as np
import pytest

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.examples import load_example
from muscle_bayes.inference.posteriors import predictive
from muscle_bayes.inference.posteriors.predict import Prediction
from muscle_bayes.inference.posteriors.predictive import _solved, predict_from_prior

DRAWS, SIZE = 40, 6


def _prediction(run: str, unsolved: list[int]) -> Prediction:
    model = np.arange(DRAWS * SIZE, dtype=float).reshape(DRAWS, SIZE)
    model[unsolved, 2:] = np.nan
    time = np.arange(SIZE, dtype=float)
    return Prediction(
        run=run, unit="counts", scale=1.0, time=time, observed=time, model=model,
        reading=model + 0.5, hyst=model * 0.0, temperature=time, load=time,
    )  # fmt: skip


def test_a_draw_that_fails_in_one_run_is_left_out_of_all() -> None:
    found = _solved([_prediction("a", [3]), _prediction("b", [7])])
    kept = np.delete(np.arange(DRAWS), [3, 7])
    for one in found:
        assert one.model[:, 0] == pytest.approx(SIZE * kept)
        assert one.reading.shape == one.hyst.shape == (DRAWS - 2, SIZE)
        assert np.isfinite(one.reading).all()
        assert one.unsolved == 2


def test_many_draws_that_fail_are_an_error_that_names_the_run() -> None:
    with pytest.raises(MuscleBayesError, match=r"saw: the model cannot be solved in 5 of 40 draws"):
        _solved([_prediction("saw", [0, 1, 2, 3, 4])])


def test_a_prior_may_reach_where_nothing_is_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    def some(*_: object) -> list[Prediction]:
        return [_prediction("spring-1", list(range(30)))]

    monkeypatch.setattr(predictive, "predict", some)
    (found,) = predict_from_prior(load_example("spring-1"), draws=DRAWS)
    assert (found.unsolved, len(found.model)) == (30, 10)
    assert np.isfinite(found.model).all()
