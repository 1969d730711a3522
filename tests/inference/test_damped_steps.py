"""Damped steps, against linear least squares."""

import numpy as np
import pytest

from muscle_bayes.inference.search.damped_steps import LONGEST_MOVE, damped_move


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_a_step_is_the_minimum(seed: int, damping: float) -> None:
    """Damping adds a row for each entry, as long as the entry's column."""
    rng = np.random.default_rng(seed)
    matrix, right = rng.normal(size=(12, 5)), 0.5 * rng.normal(size=12)
    rows = np.sqrt(damping) * np.diag(np.linalg.norm(matrix, axis=0))
    best = np.linalg.lstsq(np.vstack([matrix, rows]), np.r_[right, np.zeros(5)])[0]
    found = damped_move(matrix.T @ matrix, -matrix.T @ right, damping)
    assert np.abs(best).max() < LONGEST_MOVE
    assert found == pytest.approx(best, abs=1e-9)


def test_a_step_is_shortened_as_a_whole() -> None:
    move = damped_move(np.eye(5), np.array([-8.0, 2.0, 0.0, 0.0, 4.0]), 0.0)
    assert move == pytest.approx(LONGEST_MOVE / 8.0 * np.array([8.0, -2.0, 0.0, 0.0, -4.0]))
