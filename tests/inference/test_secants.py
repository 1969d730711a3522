"""Secants: exact where the change they saw is all there is to know, and the condition they must keep."""

from typing import NamedTuple

import numpy as np
import pytest

from muscle_bayes.inference.search.least_squares import Row, least_squares
from muscle_bayes.inference.search.secants import Carried, carried


class Seen(NamedTuple):
    potential: float
    parts: np.ndarray
    pull: np.ndarray
    prior: np.ndarray


class Look(NamedTuple):
    seen: Seen
    gradient: np.ndarray
    information: np.ndarray
    slopes: np.ndarray

    @property
    def potential(self) -> float:
        return self.seen.potential


RNG = np.random.default_rng(3)
MATRIX, BEND, SCALES = RNG.normal(size=(3, 30, 4))
TARGET = RNG.normal(size=30)
calls = {"look": 0, "glance": 0}


def _seen(point: np.ndarray, bend: float) -> Seen:
    """Errors that bend with the point, of scales that depend on it; a normal prior."""
    log_scale = 0.1 * np.tanh(SCALES @ point)
    errors = (MATRIX @ point + bend * (BEND @ point) ** 2 - TARGET) * np.exp(-log_scale)
    total = 0.5 * errors @ errors + log_scale.sum() + 0.5 * point @ point
    return Seen(total, np.r_[errors, log_scale], -point, np.eye(4))


def _look(point: np.ndarray, bend: float) -> Look:
    seen, step = _seen(point, bend), 1e-6
    slopes = np.stack(
        [(_seen(point + d, bend).parts - _seen(point - d, bend).parts) / (2 * step)
         for d in step * np.eye(4)]
    )  # fmt: skip
    gradient = slopes @ np.r_[seen.parts[:30], np.ones(30)] - seen.pull
    return Look(seen, gradient, slopes @ slopes.T + seen.prior, slopes)


def test_along_the_move_derivatives_are_those_of_the_chord() -> None:
    here, there = np.full(4, 0.2), np.array([0.3, 0.1, 0.25, 0.0])
    look, seen = _look(here, 0.05), _seen(there, 0.05)
    found = carried(look.seen, Carried(*look[1:]), seen, there - here)
    assert (there - here) @ found.slopes == pytest.approx(seen.parts - look.seen.parts)
    whole = found.slopes @ found.slopes.T + seen.prior
    assert found.information == pytest.approx(whole, rel=1e-9)
    true = _look(there, 0.05)
    assert np.abs(found.gradient - true.gradient).max() < 0.5 * np.abs(true.gradient).max()
    stale = look.slopes @ np.r_[seen.parts[:30], np.ones(30)] - seen.pull
    assert np.linalg.norm(found.gradient - true.gradient) < np.linalg.norm(stale - true.gradient)


@pytest.mark.parametrize("bend", [0.0, 0.05, 0.2])
def test_a_descent_by_secants_ends_at_the_same_minimum_with_fewer_derivatives(bend: float) -> None:
    counts = {"looks": 0, "alone": 0}

    def looker(key: str):
        def look(points, index) -> list[Look]:
            counts[key] += len(points)
            return [_look(point, bend) for point in points]

        return look

    def glancer(points, index, rows: list[Row[Look]]) -> list[Look]:
        found = []
        for point, row in zip(points, rows, strict=True):
            seen, known = _seen(point, bend), Carried(*row.look[1:])
            found.append(Look(seen, *carried(row.look.seen, known, seen, point - row.point)))
        return found

    starts = list(0.3 * RNG.normal(size=(3, 4)))
    plain = least_squares(looker("alone"), starts, least_gain=1e-8)
    swift = least_squares(looker("looks"), starts, glancer=glancer, least_gain=1e-8)
    for one, other in zip(plain, swift, strict=True):
        assert other.potential == pytest.approx(one.potential, abs=1e-5)
        assert other.ended
        assert other.age == 0
    assert counts["looks"] < counts["alone"]
