"""Identifiability of posteriors whose directions are known."""

import json

import numpy as np
import pytest
from known_cases import posterior_of

from muscle_bayes.inference.posteriors.identifiability import identify, only_ratios

RNG = np.random.default_rng(0)
PRIOR = {name: RNG.standard_normal(4000) for name in ("a", "b", "c")}


def sum_known():
    """a + b is known to 0.01, a - b as little as before, c to 0.1."""
    gap, total = RNG.standard_normal(4000), 0.01 * RNG.standard_normal(4000)
    return {"a": (total + gap) / 2**0.5, "b": (total - gap) / 2**0.5, "c": 0.1 * PRIOR["c"][::-1]}


def test_a_known_degenerate_direction_is_reported():
    report = identify(posterior_of(PRIOR, sum_known()))
    assert len(report.undetermined) == 1
    loose = report.undetermined[0]
    assert loose.variance_ratio == pytest.approx(1.0, rel=0.1)
    assert loose.loadings["a"] == pytest.approx(-loose.loadings["b"], rel=0.05)
    assert "a" in loose.words
    assert "c" not in loose.words.split(":")[0]
    assert report.directions[-1].variance_ratio == pytest.approx(1e-4, rel=0.1)
    assert {frozenset(pair[:2]) for pair in report.trade_offs} == {frozenset("ab")}
    assert report.parameters["a"].tied_to.keys() == {"b"}
    assert "a down" in report.text() or "b down" in report.text()


def test_a_sum_of_three_ties_them_though_no_pair_correlates_fully():
    x, y = RNG.standard_normal((2, 4000))
    after = {"a": x, "b": y, "c": -x - y + 0.01 * RNG.standard_normal(4000)}
    report = identify(posterior_of(PRIOR, after))
    assert report.parameters["c"].tied_to.keys() == {"a", "b"}
    assert report.parameters["c"].explained > 0.99


def test_contraction_is_one_minus_the_ratio_of_widths():
    report = identify(posterior_of(PRIOR, sum_known()))
    assert report.parameters["c"].contraction == pytest.approx(0.9, abs=0.02)
    assert report.parameters["a"].contraction == pytest.approx(1.0 - 0.5**0.5, abs=0.05)


def test_positive_and_negative_parameters_are_seen_by_their_logarithms():
    prior = {"k": np.exp(2.0 * PRIOR["a"]), "h": -np.exp(2.0 * PRIOR["b"])}
    after = {"k": np.exp(0.2 * PRIOR["c"]), "h": -np.exp(2.0 * PRIOR["c"])}
    report = identify(posterior_of(prior, after))
    assert report.parameters["k"].logarithmic
    assert report.parameters["k"].contraction == pytest.approx(0.9, abs=0.02)
    assert report.parameters["h"].contraction == pytest.approx(0.0, abs=0.1)


def test_a_parameter_at_a_bound_is_flagged():
    prior = {"d": np.exp(PRIOR["a"]), "e": np.exp(PRIOR["b"])}
    after = {"d": np.exp(PRIOR["a"] - 6.0), "e": np.exp(PRIOR["b"] * 0.1)}
    report = identify(posterior_of(prior, after))
    assert (report.parameters["d"].edge, report.parameters["e"].edge) == ("low", "")
    assert "LOW BOUND" in report.text()


def test_one_parameter_alone_and_plain_numbers():
    report = identify(posterior_of({"d": PRIOR["a"]}, {"d": 0.01 * PRIOR["b"]}))
    assert report.undetermined == ()
    assert report.trade_offs == ()
    json.dumps(report.as_dict())
    assert "contraction" in report._repr_html_()


def test_parameters_that_are_known_but_for_a_common_scale_are_named():
    scale = np.exp(PRIOR["a"])
    prior = {"J": scale, "D": np.exp(PRIOR["b"]), "rate": np.exp(PRIOR["c"])}
    ratio = 2.0 * scale * np.exp(0.01 * RNG.standard_normal(4000))
    known = np.exp(0.01 * PRIOR["c"])
    assert only_ratios(posterior_of(prior, {"J": scale, "D": ratio, "rate": known})) == ["J", "D"]
    assert only_ratios(posterior_of(prior, {"J": known, "D": 2 * known, "rate": known})) == []
    assert only_ratios(posterior_of(prior, prior)) == []
