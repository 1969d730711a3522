"""By how much a direction's two sides differ, on changes that are known."""

import numpy as np
import pytest

from muscle_bayes.inference.sampling.linearised import asymmetries


def test_two_sides_differ_by_the_ratio_of_curvature_to_slope() -> None:
    still = [np.array([[1.0, 2.0]]), np.array([3.0])]
    slope, curvature = [np.array([[0.5, -1.0]]), np.array([2.0])], 0.3

    def moved(step: float, bend: float) -> list[np.ndarray]:
        pairs = zip(still, slope, strict=True)
        return [start + step * way + bend * step**2 * way for start, way in pairs]

    bends = (0.0, curvature)
    up, down = ([moved(step, bend) for bend in bends] for step in (1.0, -1.0))
    assert asymmetries(up, down, still) == pytest.approx([0.0, curvature], abs=1e-12)


def test_a_direction_of_which_readings_know_nothing_is_even() -> None:
    still = [np.array([1.0, 2.0])]
    assert asymmetries([still], [still], still) == pytest.approx([0.0])


def test_what_cannot_be_simulated_does_not_count() -> None:
    still, failed = [np.zeros(2)], [np.array([1.0, np.inf])]
    found = asymmetries([failed], [[np.array([-1.0, np.nan])]], still)
    assert found == pytest.approx([0.0])
