"""Failed readings are told from a signal's own rate; what the signal does itself is left alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from muscle_bayes.data.repairing.faults import FAILURES, TEMPERATURE_FLOOR
from muscle_bayes.data.repairing.jumps import find_frozen, find_jumps
from muscle_bayes.data.repairing.slow_columns import is_slower

RNG = np.random.default_rng(3)
TIME = np.arange(2000) * 0.03
HEATING = 25 + 60 * (1 - np.exp(-TIME / 8))


def held(values, rows=13):
    """As a meter shows it: a new value every so many rows, in steps of 0.1."""
    return np.round(np.repeat(values[::rows], rows)[: values.size], 1)


SIGNALS = {
    "a smooth course": HEATING,
    "a meter's steps": held(HEATING),
    "a noisy thermocouple": HEATING + RNG.normal(0, 0.5, TIME.size),
    "heavy-tailed noise": HEATING + 0.1 * RNG.standard_t(3, TIME.size),
    "a room": np.full(TIME.size, 25.0),
    "a room with the last digit flickering": np.round(25 + RNG.normal(0, 0.05, TIME.size), 1),
    "a heater pulse": np.where((TIME > 20) & (TIME < 40), 60.0, 25.0),
    "a square wave": 25.0 + 30.0 * (np.floor(TIME / 3) % 2),
    "a sawtooth": 25 + (7 * TIME) % 60,
    "a fast oscillation": 40 + 20 * np.sin(40 * TIME),
}


@pytest.mark.parametrize("kind", SIGNALS)
def test_a_sound_signal_is_left_alone(kind):
    assert not find_jumps(SIGNALS[kind], TEMPERATURE_FLOOR, FAILURES).any()
    assert not find_frozen(SIGNALS[kind], TEMPERATURE_FLOOR).any()


@pytest.mark.parametrize("failure", [-1.0, 0.0, 85.0, 127.0, 200.0])
@pytest.mark.parametrize("kind", ["a smooth course", "a meter's steps", "a noisy thermocouple"])
def test_failed_readings_are_found(kind, failure):
    signal = SIGNALS[kind].copy()
    width = 13 if kind == "a meter's steps" else 1
    at = [13 * n for n in (3, 8, 10, 20)]
    for first in at:
        signal[first : first + width] = failure
    wanted = np.zeros(signal.size, dtype=bool)
    for first in at:
        wanted[first : first + width] = True
    found = find_jumps(signal, TEMPERATURE_FLOOR, FAILURES)
    assert (found == wanted).all()


def test_an_encoder_that_misreads_once():
    swing = np.round(np.cos(7 * TIME) / 0.00153) * 0.00153
    assert not find_jumps(swing).any()
    swing[500] = 6.0
    assert np.flatnonzero(find_jumps(swing)).tolist() == [500]


def test_a_frozen_reading_is_found_where_it_jumps_on():
    signal = HEATING.copy()
    signal[200:600] = signal[200]
    assert find_frozen(signal).sum() == 399
    # Before it jumps on, it might as well be at rest.
    assert not find_frozen(signal[:500]).any()


def test_too_little_to_know_its_rate():
    assert not find_jumps(np.array([1.0, 2.0, 99.0, 3.0])).any()
    assert not find_jumps(np.array([])).any()
    assert not find_frozen(np.array([1.0])).any()


@settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-1e30, 1e30), max_size=60))
def test_any_numbers_have_an_answer(values):
    signal = np.array(values)
    assert find_jumps(signal).shape == find_frozen(signal).shape == signal.shape


@pytest.mark.parametrize(
    ("present", "slower"),
    [
        (np.arange(200) % 10 == 0, True),
        (np.arange(200) % 2 == 0, True),
        (np.arange(200) % 10 == 5, True),
        ((np.arange(200) + np.arange(200) // 37) % 7 == 0, True),
        (np.arange(200) < 20, False),
        (np.arange(200) > 180, False),
        (np.arange(200) % 10 != 0, False),
        (np.arange(200) == 3, False),
        (np.zeros(200, bool), False),
    ],
)
def test_a_slower_sensor_is_blank_by_a_pattern(present, slower):
    assert is_slower(~present) is slower
