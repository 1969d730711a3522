"""RMSE, coverage and PIT of predictions whose truth is known."""

import json

import numpy as np
import pytest
from known_cases import gaussian
from scipy.stats import kstest

from muscle_bayes.criticism.coverage import check_run, coverage, judged_rmse, pit, rmse, windows


@pytest.mark.parametrize("level", [0.5, 0.9])
def test_honest_predictions_cover_at_their_level(level):
    four_errors = 4.0 * np.sqrt(level * (1.0 - level) / 2000)
    assert coverage(gaussian(), level) == pytest.approx(level, abs=four_errors)


def test_bands_too_narrow_cover_too_little():
    # Gaussian noise within 1.645/2 of its standard deviations: erf(1.645 / 2 / sqrt 2).
    assert coverage(gaussian(spread=1.0), 0.9) == pytest.approx(0.589, abs=0.05)


def test_pit_of_honest_predictions_is_uniform():
    assert kstest(pit(gaussian()), "uniform").pvalue > 0.01


@pytest.mark.parametrize("wrong", [{"bias": 1.0}, {"spread": 1.0}, {"spread": 4.0}])
def test_pit_of_wrong_predictions_is_not(wrong):
    assert kstest(pit(gaussian(**wrong)), "uniform").pvalue < 1e-6


def test_pit_of_equal_draws_is_spread_over_them():
    one = gaussian(observed=np.zeros(2000), reading=np.zeros((50, 2000)))
    assert kstest(pit(one), "uniform").pvalue > 0.01


def test_rmse_in_counts_degrees_and_millimetres():
    one = gaussian(observed=np.full(2000, 3.0))
    assert rmse(one) == pytest.approx(3.0)
    assert judged_rmse(one) == pytest.approx(0.75)
    assert judged_rmse(one._replace(scale=-one.scale)) == pytest.approx(0.75)
    assert judged_rmse(one._replace(unit="m", scale=1.0)) == pytest.approx(3000.0)


def test_a_bias_in_one_window_shows_there_only():
    one = gaussian()
    late = one.time >= 90.0
    found = windows(one._replace(observed=one.observed + 6.0 * late))
    assert found[-1].bias == pytest.approx(6.0, abs=0.8)
    assert found[-1].coverage90 < 0.2
    assert all(w.coverage90 > 0.8 and abs(w.bias) < 0.8 for w in found[:-1])
    assert sum(w.readings for w in found) == 2000


def test_a_span_without_readings_is_told_as_such():
    one = gaussian(readings=2, draws=50, time=np.array([0.0, 10.0]))
    found = windows(one)
    assert [w.readings for w in found] == [1] + [0] * 8 + [1]
    assert np.isnan(found[3].rmse)


def test_report_is_plain_and_shown():
    check = check_run(gaussian())
    told = json.loads(json.dumps(check.as_dict()))
    assert {"rmse", "unit", "rmse_deg", "coverage50", "coverage90"} <= told.keys()
    assert sum(told["pit_histogram"]) == pytest.approx(1.0)
    assert "RMSE" in check._repr_html_()
