"""Factored precision matrices against dense algebra."""

import numpy as np
import pytest

from muscle_bayes.inference.search.factored import FactoredPrecision


@pytest.fixture
def matrix() -> np.ndarray:
    rng = np.random.default_rng(0)
    slopes = rng.standard_normal((30, 5))
    return slopes.T @ slopes + 0.1 * np.eye(5)


def test_algebra_is_that_of_the_matrix(matrix: np.ndarray) -> None:
    found = FactoredPrecision(matrix)
    right = np.arange(10.0).reshape(5, 2)
    np.testing.assert_allclose(found.solve(right), np.linalg.solve(matrix, right), rtol=1e-9)
    np.testing.assert_allclose(found.solve(right[:, 0]), np.linalg.solve(matrix, right[:, 0]))
    np.testing.assert_allclose(found.inverse(), np.linalg.inv(matrix), rtol=1e-9)
    assert found.log_determinant == pytest.approx(np.linalg.slogdet(matrix)[1])


def test_draws_have_the_covariance(matrix: np.ndarray) -> None:
    root = FactoredPrecision(matrix).spread(np.eye(5))
    np.testing.assert_allclose(root @ root.T, np.linalg.inv(matrix), rtol=1e-9)


def test_directions_told_very_unequally_are_no_obstacle(matrix: np.ndarray) -> None:
    scale = 10.0 ** np.array([0.0, 12.0, -3.0, 5.0, 9.0])
    uneven = matrix * np.outer(scale, scale)
    found = FactoredPrecision(uneven)
    expected = np.linalg.inv(matrix) / np.outer(scale, scale)
    np.testing.assert_allclose(found.inverse(), expected, rtol=1e-8)
