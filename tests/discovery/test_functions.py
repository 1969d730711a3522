"""Smooth functions on a port, against NumPy's Chebyshev polynomials."""

import numpy as np
import pytest

from muscle_bayes.discovery.functions import _rounded
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.physics.effect import Signals
from muscle_bayes.physics.effects import effect_type
from muscle_bayes.physics.effects.empirical import (
    PORT_SIGNALS,
    SIGNALS,
    TERMS,
    function_name,
    polynomial,
)

NUMBERS = {name: 0.1 * (1 + place) for place, name in enumerate(Signals._fields)}
NOW = Signals(**(NUMBERS | {"memory": {}}))  # type: ignore[arg-type]
SIZES = np.array([0.3, -0.2, 0.1, 0.05, -0.04, 0.02])


def test_polynomial_is_chebyshevs() -> None:
    for signal in (-2.0, -1.0, 0.3, 1.9, 2.0, 7.0):
        x = np.clip(signal / 2.0, -1.0, 1.0)
        wanted = np.polynomial.chebyshev.chebval(x, [0.0, *SIZES])
        assert float(polynomial(list(SIZES), signal, -2.0, 2.0)) == pytest.approx(wanted)


@pytest.mark.parametrize("port", PORT_SIGNALS)
def test_a_search_and_a_fit_use_the_same_function(port: str) -> None:
    signal = PORT_SIGNALS[port][0]
    sizes = {f"c{order}": SIZES[order % SIZES.size] for order in range(1, TERMS + 1)}
    named = effect_type(function_name(port, signal, -0.5, 1.5))(**sizes)
    weights = {f"w_{name}": float(name == signal) for name in SIGNALS}
    searched = effect_type(f"unknown-{port}")(**sizes, **weights, low=-0.5, high=1.5)
    assert float(named(2.0, NOW)) == pytest.approx(float(searched(2.0, NOW)))
    assert float(named(2.0, NOW)) != pytest.approx(2.0)
    nothing = effect_type(function_name(port, signal, -0.5, 1.5)).off()
    assert float(nothing(2.0, NOW)) == 2.0


@pytest.mark.parametrize(
    "name",
    ["unknown-torque(q)", "unknown-torque(q:1:0)", "unknown-heat(q:0:1)", "unknown-torque(x:0:1)"],
)
def test_names_that_are_none(name: str) -> None:
    with pytest.raises(MuscleBayesError, match="is no function"):
        effect_type(name)


def test_ranges_are_round_and_hold_the_values() -> None:
    values = np.random.default_rng(0).uniform(-0.613, 0.788, 5000)
    low, high = _rounded(values)
    assert low <= np.quantile(values, 0.005)
    assert high >= np.quantile(values, 0.995)
    assert (low, high) == pytest.approx((-0.8, 0.8))
