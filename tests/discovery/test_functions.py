"""Smooth functions on a port, against NumPy's Chebyshev polynomials."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from muscle_bayes.discovery.functions import _rounded
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.running.precision import double_precision
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


@double_precision
def test_slopes_of_the_polynomial_are_chebyshevs() -> None:
    """First and mixed second derivatives, in coefficients and in the signal."""
    chebyshev = np.polynomial.chebyshev
    x, series = 0.3, [0.0, *SIZES]

    def value(c: Array, signal: Array) -> Array:
        return polynomial(list(c), signal, -1.0, 1.0)

    by_size, by_signal = jax.jacfwd(value, (0, 1))(jnp.asarray(SIZES), x)
    terms = chebyshev.chebvander(np.array(x), SIZES.size)[..., 1:].ravel()
    np.testing.assert_allclose(by_size, terms, rtol=1e-12)
    assert float(by_signal) == pytest.approx(chebyshev.chebval(x, chebyshev.chebder(series)))
    twice = jax.jacfwd(jax.jacfwd(value, 1), (0, 1))(jnp.asarray(SIZES), x)
    units = np.hstack([np.zeros((SIZES.size, 1)), np.eye(SIZES.size)])
    mixed = [chebyshev.chebval(x, chebyshev.chebder(unit)) for unit in units]
    np.testing.assert_allclose(twice[0], mixed, rtol=1e-12)
    bent = chebyshev.chebval(x, chebyshev.chebder(series, 2))
    assert float(twice[1]) == pytest.approx(bent)


@pytest.mark.parametrize("port", PORT_SIGNALS)
def test_a_search_and_a_fit_use_the_same_function(port: str) -> None:
    signal = PORT_SIGNALS[port][0]
    sizes = {f"c{order}": SIZES[order % SIZES.size] for order in range(1, TERMS + 1)}
    named = effect_type(function_name(port, signal, -0.5, 1.5))(**sizes)
    weights = {f"w_{name}": float(name == signal) for name in SIGNALS}
    searched = effect_type(f"unknown-{port}")(**sizes, **weights, low=-0.5, high=1.5)
    assert float(named(2.0, NOW)) == pytest.approx(float(searched(2.0, NOW)))
    assert float(named(2.0, NOW)) != pytest.approx(2.0)
    without = effect_type(f"unknown-{port}").off()
    assert float(without(2.0, NOW)) == 2.0
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
