"""Levenberg-Marquardt of many rows, against least squares whose solution is known."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pytest

from muscle_bayes.inference.search.least_squares import Row, damped_move, least_squares


class Seen(NamedTuple):
    potential: float
    gradient: np.ndarray
    information: np.ndarray


def _linear(matrix: np.ndarray, right: np.ndarray):
    def look(points: Sequence[np.ndarray], rows: Sequence[int]) -> list[Seen]:
        errors = [matrix @ point - right for point in points]
        return [Seen(0.5 * e @ e, matrix.T @ e, matrix.T @ matrix) for e in errors]

    return look


def _rosenbrock(points: Sequence[np.ndarray], rows: Sequence[int]) -> list[Seen]:
    found = []
    for x, y in points:
        errors = np.array([10.0 * (y - x * x), 1.0 - x])
        slopes = np.array([[-20.0 * x, 10.0], [-1.0, 0.0]])
        information = slopes.T @ slopes + 1e-9 * np.eye(2)
        found.append(Seen(0.5 * errors @ errors, slopes.T @ errors, information))
    return found


@pytest.fixture
def problem() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    return rng.normal(size=(12, 5)), 0.5 * rng.normal(size=12)


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_a_step_is_the_minimum(problem, damping: float) -> None:
    """Damping adds a row for each entry, as long as the entry's column."""
    matrix, right = problem
    rows = np.sqrt(damping) * np.diag(np.linalg.norm(matrix, axis=0))
    best = np.linalg.lstsq(np.vstack([matrix, rows]), np.r_[right, np.zeros(5)])[0]
    seen = Seen(0.0, -matrix.T @ right, matrix.T @ matrix)
    found = damped_move(Row(np.zeros(5), seen, damping), (), np.inf)
    assert found == pytest.approx(best, abs=1e-9)
    short = damped_move(Row(np.zeros(5), seen, damping), (), 0.1 * np.abs(best).max())
    assert short == pytest.approx(0.1 * best, abs=1e-9)


def test_every_start_ends_at_the_solution(problem) -> None:
    matrix, right = problem
    best = np.linalg.lstsq(matrix, right)[0]
    starts = list(np.random.default_rng(1).normal(size=(6, 5)))
    for row in least_squares(_linear(matrix, right), starts, least_gain=1e-12):
        assert row.point == pytest.approx(best, abs=1e-6)
        assert row.ended


def test_entries_that_are_not_free_stay(problem) -> None:
    matrix, right = problem
    free = np.array([True, False, True, True, False])
    (row,) = least_squares(
        _linear(matrix, right), [np.ones(5)], np.flatnonzero(~free), least_gain=1e-12
    )
    rest = right - matrix[:, ~free].sum(axis=1)
    assert row.point[~free] == pytest.approx(1.0, abs=0.0)
    assert row.point[free] == pytest.approx(np.linalg.lstsq(matrix[:, free], rest)[0], abs=1e-6)


def test_a_curved_valley_is_followed_in_steps_that_are_cut_short() -> None:
    (row,) = least_squares(_rosenbrock, [np.array([-1.2, 1.0])], (), 200, longest=0.05)
    assert row.point == pytest.approx([1.0, 1.0], abs=0.05)
    assert row.steps > 20


def test_rows_that_have_ended_or_fallen_behind_are_not_looked_at(problem) -> None:
    matrix, right = problem
    inner, asked = _linear(matrix, right), []

    def look(points, rows):
        asked.append(list(rows))
        return inner(points, rows)

    best = np.linalg.lstsq(matrix, right)[0]
    found = least_squares(look, [best, best + 1.0, best + 50.0], behind=100.0)
    assert asked[0] == [0, 1, 2]
    assert all(2 not in rows for rows in asked[1:])
    assert found[2].point == pytest.approx(best + 50.0)
    assert asked[-1] == [1]


def test_no_step_ends_where_derivatives_are_not_finite(problem) -> None:
    matrix, right = problem
    inner, calls = _linear(matrix, right), []

    def look(points, rows):
        calls.append(points)
        seen = inner(points, rows)
        if len(calls) == 2:
            return [one._replace(gradient=one.gradient * np.nan) for one in seen]
        return seen

    (row,) = least_squares(look, [np.ones(5)], least_gain=1e-12)
    assert row.point == pytest.approx(np.linalg.lstsq(matrix, right)[0], abs=1e-6)


def test_a_start_that_cannot_be_evaluated_stays(problem) -> None:
    def look(points, rows):
        return [Seen(np.nan, np.zeros(5), np.eye(5)) for _ in points]

    (row,) = least_squares(look, [np.ones(5)])
    assert row.potential == np.inf
    assert row.point == pytest.approx(1.0)
