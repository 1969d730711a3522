"""Thermometers err: their noise is found in the log, and widens what readings may be."""

from pathlib import Path

import numpy as np
import pytest

from muscle_bayes.data import read_run
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.model.temperature_errors import (
    response_to_temperature,
    with_temperature_errors,
)
from muscle_bayes.inference.records.thermometer import (
    course,
    course_variance,
    meter_noise,
)

DATA = Path(__file__).parents[2] / "data" / "plain"
ROWS = np.arange(0.0, 120.0, 0.03)
PERIOD = 0.4


def logged(seed: int, noise: float = 0.08, resolution: float = 0.1) -> np.ndarray:
    """What a meter shows in every row of a heat-up and a cooling: a new value every 0.4 s."""
    rng = np.random.default_rng(seed)
    when = np.arange(-PERIOD, ROWS[-1], PERIOD)
    seen = truth(when) + noise * rng.standard_normal(when.size)
    seen = np.round(seen / resolution) * resolution
    return seen[np.searchsorted(when, ROWS, side="right") - 1]


def truth(time: np.ndarray) -> np.ndarray:
    warm = 25.0 + 60.0 * (1.0 - np.exp(-np.maximum(time, 0.0) / 20.0))
    return np.where(time < 60.0, warm, 25.0 + (warm - 25.0) * np.exp(-(time - 60.0) / 40.0))


@pytest.mark.parametrize(("noise", "resolution"), [(0.08, 0.1), (0.3, 0.1), (0.02, 0.25)])
def test_the_scatter_of_updates_tells_noise_and_resolution(noise: float, resolution: float) -> None:
    found = np.mean([meter_noise(ROWS, logged(seed, noise, resolution)) for seed in range(5)])
    assert found == pytest.approx(np.hypot(noise, resolution / np.sqrt(12.0)), rel=0.25)


def test_the_variance_of_the_course_is_that_of_repeated_logs() -> None:
    nodes = np.linspace(5.0, 55.0, 26)
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    drawn = np.array([course(ROWS, logged(seed), middles).value for seed in range(60)])
    stated = course_variance(ROWS, logged(0), middles)
    assert np.median(stated) == pytest.approx(np.mean(drawn.var(axis=0)), rel=0.35)


def test_rounding_errs_alike_as_long_as_one_value_is_shown() -> None:
    """A meter without noise that drifts slowly past its steps is off by up to half a step, however often it
    is read; one that passes them quickly errs less, as errors of many values are averaged."""
    coarse = logged(0, noise=0.005, resolution=0.5)
    quick, slow = course_variance(ROWS, coarse, np.array([8.0, 115.0]))
    assert slow == pytest.approx(0.5**2 / 12.0, rel=0.25)
    assert quick < 0.5 * slow


def test_the_course_does_not_climb_the_stairs_of_a_meter_that_rounds() -> None:
    """While a temperature falls, its course does, though the meter shows one value for seconds."""
    at = np.arange(70.0, 115.0, 0.25)
    found = course(ROWS, logged(1, noise=0.01, resolution=0.5), at)
    assert np.all(np.diff(found.value) < 0.0)
    assert np.sqrt(np.mean((found.value - truth(at)) ** 2)) < 0.06


def test_a_temperature_that_never_changes_has_none() -> None:
    still = np.full(ROWS.size, 25.0)
    assert not course_variance(ROWS, still, np.linspace(0.0, 100.0, 11)).any()


def test_readings_widen_by_their_response_to_temperature() -> None:
    problem = pose([read_run(DATA / "staircase-166g.csv").until(200.0)])
    values = {
        name: np.asarray(site.prior.mean, float) * np.ones(site.prior.shape())
        for name, site in problem.sites.items()
    }
    values |= {"D": np.asarray(5e-3), "J": np.asarray(1.2e-3)}
    widened = with_temperature_errors(problem, values)
    (slope,) = response_to_temperature(problem, values, 0)
    (lanes,) = widened.data.lanes
    expected = slope**2 * np.asarray(lanes.heat_variance)[..., 0]
    np.testing.assert_allclose(lanes.thermal, expected)
    assert np.asarray(lanes.thermal).max() > 0.0
    assert not np.asarray(problem.data.lanes[0].thermal).any()


def test_runs_without_a_muscle_stay_as_they_are() -> None:
    problem = pose([read_run(DATA / "spring-1.csv")])
    assert with_temperature_errors(problem, {}) is problem
