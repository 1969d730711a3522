"""Metrics of responses that are known in closed form."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.control.closed_loop import Trace
from muscle_bayes.control.cost import Cost
from muscle_bayes.control.metrics import metrics
from muscle_bayes.control.scenarios import (
    STEP,
    course_of,
    load_step,
    setpoint_sine,
    square,
    step,
    thesis_scenarios,
)

PERIOD = 0.03


def trace_of(angle, temperature=30.0, duty=0.0):
    both = jnp.ones((len(angle), 2))
    return Trace(jnp.asarray(angle), temperature * both, duty * both, 0 * both)


judge = jax.jit(metrics, static_argnames=("period", "cycles"))


def measured(course, angle, cycles=0, **others):
    return judge(course, trace_of(angle, **others), PERIOD, cycles)


def since_step(course):
    return PERIOD * np.arange(course.setpoint.size) - 5.01  # the first period at or after 5 s


def test_first_order_lag():
    course, tau = step(PERIOD), 4.0
    time = np.maximum(since_step(course), 0.0)
    found = measured(course, STEP * (1 - np.exp(-time / tau)))
    assert float(found.rise_time) == pytest.approx(tau * np.log(9), abs=0.04)
    assert float(found.settling_time) == pytest.approx(tau * np.log(20), abs=0.07)
    assert float(found.overshoot) == 0.0
    assert float(found.steady_error) == pytest.approx(0.0, abs=1e-9)
    assert float(found.unstable) == 0.0


def test_overshoot_of_an_oscillator():
    course, zeta, omega = step(PERIOD), 0.3, 1.0
    time, damped = np.maximum(since_step(course), 0.0), np.sqrt(1 - zeta**2)
    phase = np.cos(damped * time) + zeta / damped * np.sin(damped * time)
    found = measured(course, STEP * (1 - np.exp(-zeta * omega * time) * phase))
    assert float(found.overshoot) == pytest.approx(np.exp(-np.pi * zeta / damped), abs=2e-3)


def test_what_never_settles_is_not_given_a_time():
    course = step(PERIOD)
    found = measured(course, 0.5 * course.setpoint)
    assert np.isnan(found.settling_time)
    assert np.isnan(found.rise_time)
    assert float(found.steady_error) == pytest.approx(0.5 * STEP)


def test_drift_over_cycles():
    course = square(PERIOD)
    cycles = course.setpoint.size // int(course.cycle)
    short = 0.002 + 0.001 * (np.arange(course.setpoint.size) // int(course.cycle))
    found = measured(course, course.setpoint - np.sign(course.setpoint) * short, cycles)
    assert float(found.drift) == pytest.approx(0.001)
    assert float(found.steady_error) == pytest.approx(0.002 + 0.001 * (cycles - 1))


def test_tracking_error_of_a_sine_that_is_not_followed():
    course = setpoint_sine(PERIOD, 0.1592)
    found = measured(course, 0 * course.setpoint)
    assert float(found.tracking_error) == pytest.approx(STEP / np.sqrt(2), rel=0.01)
    assert float(found.unstable) == 0.0
    assert float(measured(course, -0.2 * course.setpoint).unstable) == 1.0
    assert np.isnan(found.rise_time)


def test_disturbance_is_looked_for_after_the_load():
    course = load_step(PERIOD)
    hit = 0.03 * (np.arange(course.load.size) == 2100) - 0.05 * (np.arange(course.load.size) == 500)
    assert float(measured(course, course.setpoint + hit).disturbance) == pytest.approx(0.03)


def test_heat():
    course = step(PERIOD)
    found = measured(course, course.setpoint, temperature=111.0, duty=127.5)
    assert float(found.energy) == pytest.approx(120.0)
    assert float(found.unsafe) == 1.0
    assert float(found.limit_share) == 0.0
    assert float(measured(course, course.setpoint, duty=255.0).limit_share) == 1.0


def test_a_response_that_is_not_finite_is_unstable_and_unsafe():
    course = step(PERIOD)
    found = measured(course, course.setpoint * np.nan, temperature=np.nan)
    assert float(found.unstable) == 1.0
    assert float(found.unsafe) == 1.0


def test_cost_of_a_joint_that_stays_at_zero_is_one():
    course = course_of(np.full(100, 0.1), np.zeros(100))
    cold, hot = (Cost()(course, trace_of(np.zeros(100), temperature=t)) for t in (30.0, 110.0))
    assert float(cold) == pytest.approx(1.0)
    assert float(hot) == pytest.approx(2.0)
    assert float(Cost()(course, trace_of(course.setpoint, duty=51.0))) == pytest.approx(0.04)


def test_the_nine_are_the_thesis():
    names = [one.name for one in thesis_scenarios()]
    assert len(names) == 9
    for f in (0.0318, 0.1592, 0.4775):
        sine = next(s for s in thesis_scenarios() if s.name == f"setpoint-sine-{f:g}").course
        spectrum = np.abs(np.fft.rfft(sine.setpoint))
        peak = np.fft.rfftfreq(sine.setpoint.size, PERIOD)[spectrum.argmax()]
        assert peak == pytest.approx(f, abs=0.5 / 120)
