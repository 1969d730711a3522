"""Settling, overshoot and error of a known temperature course."""

import numpy as np
import pandas as pd
import pytest
from fake_bench import RIG

from muscle_bayes.bench.heat.settling import settlings
from muscle_bayes.bench.sequences.sequence import Sequence, Stage
from muscle_bayes.data import HEADER, read_run, write_run


def run(tmp_path, setpoint, temperature, period=0.1):
    log = pd.DataFrame({name: np.zeros(len(setpoint)) for name in HEADER})
    log[HEADER[0]] = np.arange(len(setpoint)) * period
    log[HEADER[1]], log[HEADER[2]], log[HEADER[4]] = temperature, setpoint, 25.0
    log[HEADER[8]] = 500 + np.arange(len(setpoint)) % 2
    metadata = Sequence(stage=(Stage(duration=1.0),)).metadata("measured", RIG, 0.1, "")
    return read_run(write_run(tmp_path, "x", log, metadata))


def test_damped_oscillation(tmp_path):
    time = np.arange(0, 60, 0.1)
    error = -20 * np.exp(-time / 5) * np.cos(2 * np.pi * time / 10)
    (found,) = settlings(run(tmp_path, np.full(600, 45.0), 45.0 + error))
    assert found.settled
    assert found.step == pytest.approx(20.0)
    assert found.overshoot == pytest.approx(20 * np.exp(-4.75 / 5), abs=0.3)
    assert found.settling_time == pytest.approx(time[np.abs(error) > 1.05][-1], abs=0.2)
    assert found.error == pytest.approx(0.0, abs=0.1)
    assert found.longest_error <= 1.0


def test_two_setpoints_and_a_fall(tmp_path):
    time = np.arange(0, 100, 0.1)
    falling = 25 + 40 * np.exp(-time / 10) - 2.0 * np.exp(-(((time - 60) / 5) ** 2))
    setpoint = np.r_[np.full(1000, 65.0), np.full(1000, 25.0)]
    up, down = settlings(run(tmp_path, setpoint, np.r_[np.full(1000, 65.0), falling]))
    assert (up.settled, up.settling_time, up.overshoot) == (True, 0.0, 0.0)
    assert down.step == pytest.approx(-40.0)
    assert down.overshoot == pytest.approx(2.0 - 40 * np.exp(-6.0), abs=0.15)
    assert down.start == pytest.approx(100.0)


def test_never_reached_and_off(tmp_path):
    setpoint = np.r_[np.zeros(100), np.full(300, 80.0)]
    (found,) = settlings(run(tmp_path, setpoint, np.full(400, 60.0)))
    assert not found.settled
    assert np.isnan(found.settling_time)
    assert found.error == pytest.approx(-20.0)


def test_reached_too_late_to_count(tmp_path):
    temperature = np.r_[np.full(150, 30.0), np.full(80, 40.0)]
    (found,) = settlings(run(tmp_path, np.full(230, 40.0), temperature))
    assert not found.settled
    assert np.isnan(found.settling_time)


def test_held_long_enough_and_left_again(tmp_path):
    """A stage that goes on may leave the band: it had settled, and the log tells how far it went."""
    temperature = np.r_[np.full(100, 30.0), np.full(110, 40.5), np.full(20, 41.3)]
    (found,) = settlings(run(tmp_path, np.full(230, 40.0), temperature))
    assert found.settled
    assert found.settling_time == pytest.approx(10.0)
    assert found.longest_error == pytest.approx(1.3)
