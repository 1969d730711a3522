"""Predictive comparison of posteriors with known densities."""

import json

import numpy as np
import pytest
from known_cases import posterior_of

from muscle_bayes.criticism.compare import compare, correlation_length, pointwise_elpd
from muscle_bayes.errors import MuscleBayesError

DRAWS = {"D": np.ones(50)}


def scored(observed, centre, friction):
    """Posterior that predicts unit Gaussians around `centre`, without uncertainty."""
    density = -0.5 * (observed - centre) ** 2 - 0.5 * np.log(2.0 * np.pi)
    return posterior_of(DRAWS, DRAWS, np.tile(density, (50, 1)), friction)


def test_the_model_nearer_the_truth_wins_by_the_known_amount():
    observed = np.random.default_rng(0).standard_normal(2000)
    found = compare(scored(observed, 0.0, "coulomb"), scored(observed, 0.5, "linear"))
    assert found.better == "coulomb"
    # Expected 0.5 * 0.25 for each reading, variance 0.25.
    assert found.elpd_difference == pytest.approx(250.0, abs=4.0 * np.sqrt(500.0))
    assert found.se == pytest.approx(np.sqrt(500.0), rel=0.3)
    assert json.loads(json.dumps(found.as_dict()))["per_run"]["a"]["readings"] == 2000
    assert "better: coulomb" in found._repr_html_()


def test_equal_models_tie():
    observed = np.random.default_rng(1).standard_normal(400)
    assert (
        compare(*[scored(observed, 0.0, name) for name in ("coulomb", "linear")]).better
        == "neither"
    )


def test_lasting_differences_widen_the_error():
    rng = np.random.default_rng(2)
    blocks = np.repeat(rng.standard_normal(40), 50)
    white = rng.standard_normal(2000)
    lasting, brief = (
        compare(scored(x, 0.5, "coulomb"), scored(x, -0.5, "linear")).se for x in (blocks, white)
    )
    assert lasting > 3.0 * brief
    assert correlation_length(blocks) == pytest.approx(50.0, rel=0.5)


def test_elpd_takes_the_uncertainty_of_parameters_off():
    ll = np.log(np.array([[0.2], [0.4]]))
    assert pointwise_elpd(ll)[0] == pytest.approx(np.log(0.3) - 0.5 * np.log(2.0) ** 2)


def test_different_data_are_refused():
    first, second = (scored(np.zeros(size), 0.0, "coulomb") for size in (100, 90))
    with pytest.raises(MuscleBayesError, match="different readings"):
        compare(first, second)
