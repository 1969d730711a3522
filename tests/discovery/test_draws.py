"""Importance sampling about a mode, against densities whose integral is known."""

from types import SimpleNamespace
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.discovery.draws import Draws, curves, sampled
from muscle_bayes.inference.search.factored import FactoredPrecision

SPREAD = np.array([1.0, 0.1, 3.0])


def _of(potential) -> Draws:
    """Draws of a density about 0, Laplace's normal having these spreads."""
    search: Any = SimpleNamespace(
        seed=0,
        explained=lambda rows: [
            SimpleNamespace(potential=potential(row.point[:3])) for row in rows
        ],
    )
    fitted: Any = SimpleNamespace(
        effects=(),
        point=np.zeros(5),
        data=None,
        used=3,
        potential=potential(np.zeros(3)),
        seen=SimpleNamespace(prior=np.diag(np.full(5, 0.01))),
        precision=FactoredPrecision(np.diag(SPREAD**-2)),
        log_evidence=1.5 * np.log(2.0 * np.pi) + np.log(SPREAD).sum(),
    )
    return sampled(search, fitted, count=400)


def test_a_normal_is_what_laplace_says() -> None:
    found = _of(lambda x: 0.5 * np.sum((x / SPREAD) ** 2))
    assert found.good
    assert found.log_evidence == pytest.approx(found.laplace, abs=0.1)
    assert found.points[:, :3].std(axis=0) == pytest.approx(SPREAD, rel=0.2)
    assert np.all(found.points[:, 3:] == 0.0)


def test_a_bent_density_is_corrected() -> None:
    """Sheared by a parabola, which changes no volume; and half of it is cut off."""

    def bent(x: np.ndarray) -> float:
        if x[1] < 0.0:
            return np.inf
        return 0.5 * np.sum((np.array([x[0], x[1], x[2] - 2.0 * x[0] ** 2]) / SPREAD) ** 2)

    found = _of(bent)
    assert found.good
    assert found.log_evidence == pytest.approx(found.laplace - np.log(2.0), abs=0.25)
    assert "nat off Laplace's" in found.text("slack")


def test_walls_and_long_tails_are_found() -> None:
    """A wall at a tenth of a standard deviation, and a tail that falls as slowly as exp(-|x|)."""

    def uneven(x: np.ndarray) -> float:
        if x[0] > 0.1 * SPREAD[0]:
            return np.inf
        return (
            0.5 * (x[0] / SPREAD[0]) ** 2 + np.logaddexp(3.0 * x[1] / SPREAD[1], -x[1]) + x[1] ** 2
        )

    def alone(low: float, high: float, level) -> float:
        x = np.linspace(low, high, 20001)
        return float(np.trapezoid(np.exp(-level(x)), x))

    found = _of(lambda x: uneven(x) + 0.5 * (x[2] / SPREAD[2]) ** 2)
    whole = (
        alone(-8.0, 0.1, lambda x: 0.5 * x**2)
        * alone(-8.0, 3.0, lambda x: np.logaddexp(3.0 * x / SPREAD[1], -x) + x**2)
        * np.sqrt(2.0 * np.pi) * SPREAD[2]
    )  # fmt: skip
    assert found.good
    assert found.effective > 100.0
    assert found.log_evidence == pytest.approx(np.log(whole), abs=0.2)
    assert found.points[:, 0].max() <= 0.1 * SPREAD[0]


def test_draws_that_do_not_count_are_told() -> None:
    far = 60.0 * SPREAD
    found = _of(lambda x: 0.5 * np.sum((30.0 * (x - far) / SPREAD) ** 2))
    assert not found.good
    assert found.log_evidence == found.laplace
    assert "not confirmed" in found.text("slack")


def test_a_function_is_worked_out_for_every_draw() -> None:
    coefficients = np.random.default_rng(0).standard_normal((7, 4))
    signal = np.linspace(2.0, 5.0, 11)
    x = (2.0 * signal - 7.0) / 3.0
    exact = [np.polynomial.chebyshev.chebval(x, [0.0, *one]) for one in coefficients]
    found = curves(jnp.asarray(coefficients), jnp.asarray(signal), 2.0, 5.0)
    np.testing.assert_allclose(found, exact, atol=1e-5)
