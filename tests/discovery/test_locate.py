"""Windows against data sets whose misfit is known."""

import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.data.writer import write_run
from muscle_bayes.discovery.conditions import Trace
from muscle_bayes.discovery.describe import where
from muscle_bayes.discovery.locate import LEAST_P, of_largest, scan
from muscle_bayes.discovery.tolerance import noise_of_reading
from muscle_bayes.twin import Rig, simulate, spring_rig
from muscle_bayes.twin.protocols import spring

SIZES = (150, 90)


def _slopes(rng: np.random.Generator) -> np.ndarray:
    return np.linalg.qr(rng.standard_normal((sum(SIZES), 6)))[0] * 20.0


def test_without_misfit_p_values_are_uniform() -> None:
    rng = np.random.default_rng(1)
    slopes = _slopes(rng)
    information = slopes.T @ slopes + 1e-4 * np.eye(6)
    found = np.array(
        [
            scan(rng.standard_normal(sum(SIZES)), slopes, information, SIZES, seed).p_value.min()
            for seed in range(200)
        ]
    )
    for level in (0.05, 0.2, 0.5):
        # Four binomial standard deviations.
        width = 4.0 * np.sqrt(level * (1.0 - level) / found.size)
        assert abs(np.mean(found <= level) - level) < width


def test_p_values_beyond_the_replicates_follow_the_tail() -> None:
    """Largest of 300 windows' scores: 400 replicates tell p-values down to 1e-4 within a factor 3."""
    rng = np.random.default_rng(4)
    draws = rng.chisquare(20, (40_000, 300)).max(axis=1)
    few = draws[:400]
    levels = np.array([0.2, 0.01, 1e-3, 1e-4])
    scores = np.quantile(draws, 1.0 - levels)
    found = of_largest(scores, few)
    assert np.all(np.abs(np.log(found / levels)) < np.log([1.5, 2.0, 3.0, 3.0]))
    assert of_largest(np.array([1e6]), few)[0] == LEAST_P
    assert np.all(np.diff(of_largest(np.linspace(20.0, 90.0, 500), few)) <= 1e-15)


def test_a_misfit_is_found_where_it_is() -> None:
    rng = np.random.default_rng(2)
    slopes = _slopes(rng)
    errors = rng.standard_normal(sum(SIZES))
    errors[180:200] += 3.0
    found = scan(errors, slopes, slopes.T @ slopes + 1e-4 * np.eye(6), SIZES, 0)
    best = int(np.argmax(found.score))
    assert found.p_value[best] < 0.01
    assert found.run[best] == 1
    assert found.start[best] < 200
    assert found.end[best] > 180
    assert found.end[best] - found.start[best] <= 45


def test_a_small_misfit_that_lasts_is_found() -> None:
    """0.7 standard deviations over 75 errors: 3 of its own in the sum of squares, whose p-value is 0.01,
    and 6 in the sum."""
    rng = np.random.default_rng(5)
    slopes = _slopes(rng)
    errors = rng.standard_normal(sum(SIZES))
    errors[75:150] += 0.7
    found = scan(errors, slopes, slopes.T @ slopes + 1e-4 * np.eye(6), SIZES, 0)
    best = int(np.argmax(found.score))
    assert found.p_value[best] < 1e-3
    assert found.lasting[best]
    assert found.start[best] == pytest.approx(75, abs=2)
    assert found.end[best] == pytest.approx(150, abs=2)
    # What the window's mean explains, against 0.7^2 for each error; parameters absorb a part.
    assert found.excess(best).sum() == pytest.approx(0.49 * 75, rel=0.4)


def test_what_parameters_absorb_is_no_misfit() -> None:
    rng = np.random.default_rng(3)
    slopes = _slopes(rng)
    errors = rng.standard_normal(sum(SIZES)) + slopes @ rng.standard_normal(6)
    found = scan(errors, slopes, slopes.T @ slopes + 1e-8 * np.eye(6), SIZES, 0)
    assert found.p_value.min() > 0.05


def _trace(**signals: np.ndarray) -> Trace:
    size = len(next(iter(signals.values())))
    time = np.arange(size, dtype=float)
    return Trace(
        "run",
        "counts",
        time,
        np.ones(size),
        np.zeros(size),
        np.arange(size),
        np.arange(size),
        signals,
    )


def test_conditions_are_named() -> None:
    time = np.arange(400)
    temperature = 55.0 + 35.0 * np.sin(time / 20.0)
    strain = 0.05 * np.cos(time / 33.0)
    trace = _trace(T=temperature, sigma=strain)
    hot_and_short = (temperature > 80.0) & (strain < 0.0)
    text = where(trace, hot_and_short * 9.0, slice(0, 400))
    assert "T > " in text
    assert "sigma < 0" in text
    assert " and " in text
    assert where(trace, np.ones(400), slice(0, 400)) == "throughout"
    assert where(trace, -np.ones(400), slice(0, 400)) == "throughout"


@pytest.mark.parametrize("noise", [0.4, 0.8])
def test_noise_is_told_from_rounding(tmp_path, noise: float) -> None:
    from dataclasses import replace

    rig = spring_rig(Rig())
    rig = replace(rig, potentiometer=replace(rig.potentiometer, count_noise=noise))
    logs = [simulate(rig, replace(spring(0.12), log_period=0.01), (5, n)) for n in range(4)]
    for number, run in enumerate(logs):
        write_run(tmp_path, f"run-{number}", run.log, run.metadata)
    told = np.mean([noise_of_reading(run) for run in read_runs([tmp_path])])
    assert told == pytest.approx(noise, rel=0.2)
