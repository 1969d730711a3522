"""Temperatures behind a meter's readings against courses that are known."""

import tracemalloc

import numpy as np
import pytest

from muscle_bayes.inference.records.thermometer import WINDOW, course, deceleration, updates

HOLD = 0.4


def logged(temperature, duration=60.0, noise=0.0, resolution=0.0, seed=0):
    """Times and readings of a log that repeats a meter's value for HOLD seconds."""
    time = np.arange(0.0, duration, 0.1)
    measured = np.floor(time / HOLD + 1e-9) * HOLD
    values = temperature(measured)
    kicks = np.random.default_rng(seed).normal(0.0, noise, int(duration / HOLD) + 2)
    values = values + kicks[np.round(measured / HOLD).astype(int)]
    return time, np.round(values / resolution) * resolution if resolution else values


def test_only_new_values_count_and_are_placed_between_rows():
    time, values = updates(*logged(lambda t: 3.0 * t, 4.0))
    np.testing.assert_allclose(np.diff(time[1:]), HOLD)
    np.testing.assert_allclose(values, 3.0 * HOLD * np.arange(values.size))
    np.testing.assert_allclose(time[1:] - values[1:] / 3.0, -0.05)


def test_a_new_value_in_every_row_is_read_then():
    time = np.arange(0.0, 20.0, 0.5)
    instants, values = updates(time, 25.0 + 2.0 * time)
    np.testing.assert_allclose(instants, time)
    np.testing.assert_allclose(values, 25.0 + 2.0 * time)


def test_steady_temperature_keeps_telling():
    time, _ = updates(*logged(lambda t: 0.0 * t + 25.0))
    assert np.diff(time).max() < 0.75


@pytest.mark.parametrize("bend", [-2.0, 0.0, 1.0])
def test_quadratic_course_is_found_exactly(bend):
    found = course(
        *logged(lambda t: 40.0 + 3.0 * t + 0.5 * bend * t**2, 30.0), np.array([5.0, 9.3])
    )
    # The meter's instants lie half a row after those of the log.
    at = np.array([5.0, 9.3]) + 0.05
    np.testing.assert_allclose(found.value, 40.0 + 3.0 * at + 0.5 * bend * at**2, atol=1e-8)
    np.testing.assert_allclose(found.rate, 3.0 + bend * at, atol=1e-8)
    np.testing.assert_allclose(found.curvature, bend, atol=1e-8)


def test_peaks_of_noisy_rounded_readings_are_not_cut():
    peaks, at = [], np.array([29.95])
    for seed in range(200):
        log = logged(lambda t: 80.0 - 0.75 * (t - 30.0) ** 2, noise=0.05, resolution=0.1, seed=seed)
        peaks.append(course(*log, at).value[0])
    error = np.std(peaks) / np.sqrt(len(peaks))
    assert error < 0.005
    assert abs(np.mean(peaks) - 80.0) < 3.0 * error + 0.002


@pytest.mark.parametrize("readings", [1, 2])
def test_fewer_updates_than_a_parabola_needs_are_joined_by_a_line(readings):
    found = course(np.arange(readings) * 1.0, np.arange(readings) * 10.0, np.array([0.5, 7.0]))
    assert np.isfinite(found.value).all()
    assert found.value.max() <= 10.0
    np.testing.assert_array_equal(found.curvature, 0.0)


def test_gaps_are_bridged_by_a_line_whatever_the_noise_at_their_ends():
    time = np.r_[np.arange(0.0, 5.0, 0.5), np.arange(60.0, 65.0, 0.5)]
    noise = np.random.default_rng(0).normal(0.0, 0.05, time.size)
    found = course(time, 2.0 * time + noise, np.linspace(8.0, 57.0, 9))
    np.testing.assert_allclose(found.value, 2.0 * np.linspace(8.0, 57.0, 9), atol=1.5)
    np.testing.assert_allclose(found.rate, 2.0, atol=0.3)
    np.testing.assert_array_equal(found.curvature, 0.0)


def test_a_slow_meter_has_a_longer_window():
    time = np.arange(0.0, 200.0, 2.0)
    found = course(time, 30.0 + 0.5 * 0.02 * time**2, np.array([60.0, 61.0]))
    np.testing.assert_allclose(found.curvature, 0.02, rtol=1e-6)


def test_deceleration_is_that_of_the_turn():
    time, values = logged(lambda t: 60.0 + 20.0 * np.sin(0.3 * t))
    peak, dip = np.pi / 0.6, np.pi / 0.2
    found = deceleration(time, values, np.array([peak, dip]))
    np.testing.assert_allclose(found, [20.0 * 0.3**2, -20.0 * 0.3**2], rtol=0.1)


def test_heating_that_starts_from_standstill_does_not_slow_down():
    time, values = logged(lambda t: 25.0 + 3.0 * np.maximum(t - 20.0, 0.0))
    found = deceleration(time, values, np.linspace(20.0 - WINDOW, 20.0 + WINDOW, 31))
    assert np.abs(found).max() < 0.5
    assert np.abs(course(time, values, np.array([20.0])).curvature) > 1.0


def falling(seed, rate, hold=0.4, pauses=()):
    """A log at 30 ms of a temperature that falls evenly, behind a meter of 0.1 C every `hold` s or so."""
    random = np.random.default_rng(seed)
    time = np.cumsum(random.normal(0.03, 0.003, 6000))
    measured = np.cumsum(random.normal(hold, 0.05 * hold, int(240.0 / hold)))
    values = np.round(60.0 - rate * measured + random.normal(0.0, 0.05, measured.size), 1)
    shown = np.maximum(np.searchsorted(measured, time) - 1, 0)
    paused = [(time > at) & (time < at + 1.1 * hold) for at in pauses]
    kept = (time > measured[0]) & ~np.any(paused, axis=0)
    return time[kept], values[shown][kept]


@pytest.mark.parametrize("hold", [0.4, 1.0])
@pytest.mark.parametrize("rate", [0.02, 0.1, 0.3, 1.0, 4.0])
def test_held_values_do_not_lag_while_temperature_falls_slowly(rate, hold):
    errors = []
    for seed in range(5):
        time, values = updates(*falling(seed, rate, hold, pauses=[20.0, 50.3, 111.0]))
        errors.append(values - (60.0 - rate * time))
    error = np.concatenate(errors)
    scatter = np.hypot(0.05, 0.1 / np.sqrt(12.0))
    assert abs(error.mean()) < 3.0 * scatter / np.sqrt(error.size) + 0.01 * rate
    assert error.std() < 1.1 * np.hypot(scatter, 0.1 * hold * rate)


def test_an_hour_at_one_temperature_takes_no_memory() -> None:
    """However long one value is shown, a course looks at seconds around an instant."""
    time = np.arange(0.0, 3600.0, 0.03)
    tracemalloc.start()
    found = course(time, np.full(time.size, 25.0), np.linspace(0.0, 3600.0, 700))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    np.testing.assert_allclose(found.value, 25.0)
    assert peak < 200e6
