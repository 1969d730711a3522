"""Metrics of responses that are known in closed form."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.control.closed_loop import Trace
from muscle_bayes.control.judging.metrics import BAND, metrics
from muscle_bayes.control.scenarios.scenario import course_of
from muscle_bayes.control.scenarios.thesis import (
    STEP,
    load_step,
    setpoint_sine,
    square,
    step,
    thesis_scenarios,
)

PERIOD = 0.03

judge = jax.jit(metrics, static_argnames="period")


def measured(course, angle, temperature=30.0, duty=0.0):
    both = jnp.ones((len(angle), 2))
    trace = Trace(jnp.asarray(angle), temperature * both, duty * both, 0 * both)
    return jax.tree.map(float, judge(course, trace, PERIOD))


def since_step(course):
    return np.maximum(PERIOD * np.arange(course.setpoint.size) - 5.01, 0.0)


def test_first_order_lag():
    course, tau = step(PERIOD), 4.0
    found = measured(course, STEP * (1 - np.exp(-since_step(course) / tau)))
    assert found.rise_time == pytest.approx(tau * np.log(9), abs=0.04)
    assert found.settling_time == pytest.approx(tau * np.log(STEP / BAND), abs=0.07)
    assert found.overshoot == 0.0
    assert found.steady_error == pytest.approx(0.0, abs=1e-9)
    assert found.runaway == 0.0
    assert np.isnan(found.recovery_time)


def test_overshoot_of_an_oscillator():
    course, zeta, omega = step(PERIOD), 0.3, 1.0
    time, damped = since_step(course), np.sqrt(1 - zeta**2)
    phase = np.cos(damped * time) + zeta / damped * np.sin(damped * time)
    found = measured(course, STEP * (1 - np.exp(-zeta * omega * time) * phase))
    assert found.overshoot == pytest.approx(STEP * np.exp(-np.pi * zeta / damped), rel=1e-2)


def test_what_never_settles_has_infinite_times():
    course = step(PERIOD)
    found = measured(course, 0.5 * course.setpoint)
    assert found.settling_time == np.inf
    assert found.rise_time == np.inf
    assert found.steady_error == pytest.approx(0.5 * STEP)


def test_the_worst_half_of_a_square_wave_counts():
    course = square(PERIOD)
    half = round(30.0 / PERIOD)
    place = np.arange(course.setpoint.size) % half * PERIOD
    number = np.arange(course.setpoint.size) // half
    late = np.where(number == 4, 7.0, 3.0)
    short = np.where(place < late, 0.5, 0.001 * (number + 1))
    found = measured(course, course.setpoint - np.sign(course.setpoint) * short)
    assert found.settling_time == pytest.approx(7.0, abs=0.04)
    assert found.steady_error == pytest.approx(0.010, abs=1e-6)


def test_overshoot_is_that_of_the_jumps_direction():
    course = square(PERIOD)
    below = course.setpoint - 0.01  # short of upper halves, beyond lower ones
    assert measured(course, below).overshoot == pytest.approx(0.01)
    inside = 0.9 * course.setpoint
    assert measured(course, inside).overshoot == 0.0


def test_recovery_counts_from_the_load():
    course = load_step(PERIOD)
    since = PERIOD * (np.arange(course.load.size) - np.argmax(course.load > 0))
    hit = np.where((since >= 0) & (since < 4.0), 0.03, 0.0)
    found = measured(course, course.setpoint + hit)
    assert found.recovery_time == pytest.approx(4.0, abs=0.07)
    assert found.settling_time == 0.0


def test_tracking_of_a_sine_that_is_not_followed():
    course = setpoint_sine(PERIOD, 0.1592)
    found = measured(course, 0 * course.setpoint)
    assert found.tracking == pytest.approx(1.0)
    assert found.runaway == 0.0
    assert measured(course, -1.2 * course.setpoint).runaway == 1.0
    assert np.isnan(found.settling_time)
    assert np.isnan(found.steady_error)


def test_heat():
    course = step(PERIOD)
    found = measured(course, course.setpoint, temperature=111.0, duty=127.5)
    assert found.energy == pytest.approx(120.0)
    assert found.runaway == 1.0


def test_a_response_that_is_not_finite_is_a_runaway():
    course = step(PERIOD)
    found = measured(course, course.setpoint * np.nan, temperature=np.nan)
    assert found.runaway == 1.0


def test_stretches_between_jumps():
    setpoint = np.repeat([0.0, 1.0, 1.0, -1.0], 10)
    load = np.repeat([0.0, 0.0, 0.5, 0.5], 10)
    course = course_of(setpoint, load)
    assert not course.turned[:10].any()
    assert course.turned[10:20].all()
    assert course.loaded[20:30].all()
    assert not course.turned[20:30].any()
    assert course.turned[30:].all()
    np.testing.assert_array_equal(course.since[10:30], np.tile(np.arange(10), 2))
    np.testing.assert_array_equal(course.towards[[5, 15, 25, 35]], [0, 1, 1, -1])
    assert course.late.sum() == 6


def test_the_nine_are_the_thesis():
    assert len(thesis_scenarios()) == 9
    for f in (0.0318, 0.1592, 0.4775):
        sine = next(s for s in thesis_scenarios() if s.name == f"setpoint-sine-{f:g}").course
        spectrum = np.abs(np.fft.rfft(sine.setpoint))
        peak = np.fft.rfftfreq(sine.setpoint.size, PERIOD)[spectrum.argmax()]
        assert peak == pytest.approx(f, abs=0.5 / 120)
