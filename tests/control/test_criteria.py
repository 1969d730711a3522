"""Criteria against closed forms."""

import numpy as np
import pytest
from scipy.stats import norm

from muscle_bayes.control.criteria import CVaR, MeanCost, Shortfall, cvar, cvar_weights


def test_cvar_of_a_normal_is_the_textbooks():
    """mu + sigma phi(z) / (1 - level)."""
    costs = 3.0 + 2.0 * norm.ppf((np.arange(100_000) + 0.5) / 100_000)
    expected = 3.0 + 2.0 * norm.pdf(norm.ppf(0.95)) / 0.05
    assert cvar(costs, 0.95) == pytest.approx(expected, rel=1e-4)


def test_cvar_of_a_uniform_is_the_middle_of_its_tail():
    assert cvar((np.arange(10_000) + 0.5) / 10_000, 0.9) == pytest.approx(0.95)


def test_cvar_is_the_minimum_of_rockafellar_and_uryasev():
    costs = np.random.default_rng(0).gamma(2.0, size=37)
    thresholds = np.linspace(0.0, costs.max(), 20001)
    over = np.maximum(costs - thresholds[:, None], 0.0).mean(axis=1)
    assert cvar(costs, 0.95) == pytest.approx((thresholds + over / 0.05).min(), abs=1e-4)


def test_level_zero_is_the_mean():
    costs = np.random.default_rng(1).normal(size=11)
    assert cvar(costs, 0.0) == pytest.approx(costs.mean())
    assert cvar_weights(costs, 0.0) == pytest.approx(np.full(11, 1 / 11))


@pytest.mark.parametrize(
    "criterion",
    [MeanCost(), CVaR(0.8), Shortfall((("tracking_error", 1.0), ("energy", 2.0)), softness=0.3)],
)
def test_weights_are_derivatives(criterion):
    generator = np.random.default_rng(2)
    names = ("cost", "tracking_error", "energy")
    values = {name: generator.uniform(0.5, 2.5, 23) for name in names}
    _, weights = criterion(values)
    for name, weight in weights.items():
        for draw in range(23):
            ends = []
            for sign in (1, -1):
                moved = {k: v.copy() for k, v in values.items()}
                moved[name][draw] += sign * 1e-6
                ends.append(criterion(moved)[0])
            assert weight[draw] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-7)


def test_a_hard_specification_is_its_probability():
    values = {"tracking_error": np.array([0.1, 0.5, 2.0, 3.0]), "overshoot": np.full(4, np.nan)}
    limits = (("tracking_error", 1.0), ("overshoot", 0.1))
    assert Shortfall(limits, softness=1e-3)(values)[0] == pytest.approx(0.5, abs=1e-6)
