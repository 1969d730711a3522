"""Damped steps between walls, against SciPy's bounded least squares and quadrature."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import lsq_linear

from muscle_bayes.inference.damped_steps import (
    LONGEST_MOVE,
    Walls,
    between_walls,
    damped_move,
    log_share,
)
from muscle_bayes.inference.factored import FactoredPrecision

NOWHERE = Walls(np.zeros(0), np.zeros((0, 5)))


def problem(seed):
    """A linear least-squares problem: matrix and right side."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(12, 5)), 0.5 * rng.normal(size=12)


@pytest.mark.parametrize("seed", range(8))
def test_a_step_is_the_minimum_between_walls(seed):
    matrix, right = problem(seed)
    room = np.random.default_rng(seed + 100).uniform(0.0, 0.05, 3)
    walls = Walls(room, np.eye(5)[:3])  # the first three entries may fall by so much
    lower = np.r_[-room, -np.inf, -np.inf]
    best = lsq_linear(matrix, right, (lower, np.full(5, np.inf)), tol=1e-14).x
    found = damped_move(matrix.T @ matrix, -matrix.T @ right, 0.0, walls)
    assert found == pytest.approx(best, abs=1e-7)
    free = damped_move(matrix.T @ matrix, -matrix.T @ right, 0.0, NOWHERE)
    assert free == pytest.approx(np.linalg.lstsq(matrix, right)[0], abs=1e-9)


def test_some_walls_were_met():
    met = []
    for seed in range(8):
        matrix, right = problem(seed)
        met.append(np.linalg.lstsq(matrix, right)[0][:3].min() < -0.05)
    assert sum(met) >= 2


def test_a_step_is_shortened_as_a_whole():
    move = damped_move(np.eye(5), np.array([-8.0, 2.0, 0.0, 0.0, 4.0]), 0.0, NOWHERE)
    assert move == pytest.approx(LONGEST_MOVE / 8.0 * np.array([8.0, -2.0, 0.0, 0.0, -4.0]))


def test_a_point_beyond_a_curved_wall_comes_back_onto_it():
    def walls_at(point):
        return Walls(np.array([point[1] - point[0] ** 2]), np.array([[-2.0 * point[0], 1.0]]))

    inside, walls = between_walls(np.array([2.0, 1.0]), walls_at, np.array([1]))
    assert inside == pytest.approx([2.0, 4.0], abs=1e-8)
    assert walls.room[0] >= 0.0
    same, _ = between_walls(np.array([1.0, 3.0]), walls_at, np.array([1]))
    np.testing.assert_array_equal(same, [1.0, 3.0])


@pytest.mark.parametrize(("at", "room"), [(0.3, 0.3), (0.0, 0.0), (-0.4, 0.0), (9.0, 9.0)])
def test_the_share_between_walls_is_that_of_quadrature(at, room):
    """N(at, 0.5^2) above 0, seen from its most probable point, beside an entry of its own."""
    precision = np.diag([4.0, 9.0])
    gradient = np.array([4.0 * max(-at, 0.0), 0.0])
    walls = Walls(np.array([room]), np.array([[1.0, 0.0]]))
    share = np.exp(log_share(FactoredPrecision(precision), gradient, walls))
    mass = quad(lambda x: np.exp(-2.0 * (x - at) ** 2), 0.0, at + 5.0)[0]
    height = np.exp(-2.0 * (max(at, 0.0) - at) ** 2)
    assert share == pytest.approx(mass / height / np.sqrt(2.0 * np.pi / 4.0), rel=1e-6)


def test_without_walls_the_share_is_all():
    assert log_share(FactoredPrecision(np.eye(5)), np.zeros(5), NOWHERE) == 0.0
