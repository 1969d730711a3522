"""Windows against data sets whose misfit is known."""

import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.data.writer import write_run
from muscle_bayes.discovery.conditions import Trace, where
from muscle_bayes.discovery.nominal import noise_of_reading
from muscle_bayes.discovery.scan import LEAST_P, Scan, of_largest, scan
from muscle_bayes.inference.model.rounding import rounded_errors
from muscle_bayes.twin import Rig, simulate, spring_rig
from muscle_bayes.twin.protocols import spring

SIZES, REPLICATES = (150, 90), 400


def _slopes(rng: np.random.Generator) -> np.ndarray:
    return np.linalg.qr(rng.standard_normal((sum(SIZES), 6)))[0] * 20.0


def _scanned(
    errors: np.ndarray, slopes: np.ndarray, precision: float = 1e-4, seed: int = 0
) -> Scan:
    """Against normal errors."""
    replicates = np.random.default_rng([seed, 9]).standard_normal((errors.size, REPLICATES))
    return scan(errors, slopes, slopes.T @ slopes + precision * np.eye(6), SIZES, replicates)


def test_without_misfit_p_values_are_uniform() -> None:
    rng = np.random.default_rng(1)
    slopes = _slopes(rng)
    found = np.array(
        [
            _scanned(rng.standard_normal(sum(SIZES)), slopes, seed=seed).p_value.min()
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
    found = _scanned(errors, slopes)
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
    found = _scanned(errors, slopes)
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
    found = _scanned(errors, slopes, 1e-8)
    assert found.p_value.min() > 0.05


def test_rounded_errors_are_those_of_the_sensor() -> None:
    """One reading, and the mean of 25, each as rounding 25 of them gives, from coarse to fine."""
    rng = np.random.default_rng(6)
    place = np.repeat([[0.0], [0.2], [0.5], [0.9]], 20_000, axis=1)
    for spread in (0.05, 0.25, 1.0):
        normal = rng.standard_normal((25, *place.shape))
        rounded = np.round(place + spread * normal) - place
        for readings, wanted in ((1.0, rounded[0]), (25.0, rounded.mean(axis=0))):
            found = np.concatenate(
                [
                    rounded_errors(row[None], draw[None], np.array([[readings]]), spread)
                    for row, draw in zip(place, normal[1], strict=True)
                ]
            )
            assert np.allclose(found.mean(axis=1), wanted.mean(axis=1), atol=0.03)
            assert np.allclose(found.std(axis=1), wanted.std(axis=1), atol=0.03)


def test_rounding_averages_out_of_a_mean_while_the_rotor_moves() -> None:
    place = np.arange(40.0)[:, None] + 0.3
    still = np.full((40, 1), 0.3)
    readings, none = np.full((40, 1), 30.0), np.zeros((40, 1))
    assert np.allclose(rounded_errors(place, none, readings, 0.05), 0.0, atol=1e-12)
    assert np.allclose(rounded_errors(still, none, readings, 0.05), -0.3, atol=0.01)


def test_a_rotor_at_rest_between_two_counts_is_no_misfit() -> None:
    """Its readings scatter by half a count, twice as much as rounding does on average."""
    rng = np.random.default_rng(7)
    slopes, spread = _slopes(rng), 0.2
    reading = np.concatenate([rng.uniform(0.0, 9.0, 150), np.full(90, 4.5)])[:, None]

    def drawn(seed: int, count: int) -> np.ndarray:
        rng = np.random.default_rng(seed)
        place = reading + rng.uniform(0.0, 1.0, count)
        normal = rng.standard_normal(place.shape)
        error = rounded_errors(place, normal, np.ones_like(reading), spread)
        return error / np.hypot(spread, 1.0 / np.sqrt(12.0))

    information = slopes.T @ slopes + 1e-4 * np.eye(6)
    seen, replicates = drawn(9, 50).T, drawn(8, REPLICATES)
    p_values = [scan(one, slopes, information, SIZES, replicates).p_value.min() for one in seen]
    assert np.mean(np.array(p_values) < 0.1) < 0.25
    against_normal = [_scanned(one, slopes).p_value.min() for one in seen]
    assert np.mean(np.array(against_normal) < 0.1) > 0.5


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


@pytest.mark.parametrize("share", [0.25, 1.0])
def test_noise_is_told_from_swings_that_end(tmp_path, share: float) -> None:
    """At rest a sensor of coarse steps shows hardly any noise."""
    step, time = 2.0 * np.pi / 4096, 0.005 * np.arange(1500)
    swing = np.cos(7.0 * time) * np.maximum(1.0 - time / 3.0, 0.0) + 0.05 * step
    rng = np.random.default_rng(3)
    for number in range(6):
        shown = step * np.round((swing + share * step * rng.normal(size=time.size)) / step)
        rows = [f"{t:.9g},{q:.9g}" for t, q in zip(time, shown, strict=True)]
        (tmp_path / f"swing-{number}.csv").write_text("\n".join(["time_s,angle_rad", *rows, ""]))
        (tmp_path / f"swing-{number}.toml").write_text(
            'format = 1\nprotocol = "free"\norigin = "synthetic"\n\n[columns]\ntime = "time_s"\n'
            'position = "angle_rad"\nposition_unit = "rad"\n\n[element_a]\nkind = "none"\n'
        )
    runs = read_runs([tmp_path])
    for run in runs:
        assert run.output_sensor.resolution == pytest.approx(step, rel=1e-5)
    assert np.mean([noise_of_reading(run) for run in runs]) == pytest.approx(share * step, rel=0.15)
