"""What is asked of a closed loop's response."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array

from muscle_bayes.control.closed_loop import Trace
from muscle_bayes.control.laws.law import FULL_DUTY
from muscle_bayes.control.scenarios.scenario import MOST_JUMPS, Course
from muscle_bayes.physics.linkage import Scalar

SAFE_TEMPERATURE = 110.0
"""Highest temperature that the bench's firmware lets pass [C]."""
RUNAWAY = 2.0
"""Error of a runaway, as a multiple of what staying at zero would leave: the largest peak of the
sensitivity that is thought robust (Astrom and Murray, Feedback Systems, section 13.3). Beyond its
bandwidth every loop amplifies a little (Bode's integral)."""
BAND = 0.017453292519943295
"""Half width of the band of a settled response: 1 degree [rad]."""


class Metrics(NamedTuple):
    """Of one response. NaN where the scenario has nothing of the kind."""

    rise_time: Scalar
    """From 10 to 90 % of the first jump of the setpoint [s]; infinite where it is not reached."""
    settling_time: Scalar
    """From a jump of the setpoint to the last time outside BAND, the longest [s]; infinite where the
    response is outside as the next jump comes."""
    overshoot: Scalar
    """Beyond a jump's end, the largest [rad]."""
    steady_error: Scalar
    """Mean of setpoint - angle over the last fifth between jumps, the largest magnitude [rad]."""
    recovery_time: Scalar
    """As settling_time, from a jump of the load [s]."""
    tracking: Scalar
    """RMS of setpoint - angle over RMS of the setpoint; 1 for a joint that stays at zero."""
    peak_temperature: Scalar
    """C"""
    energy: Scalar
    """Heating of both muscles together [s at full power]."""
    runaway: Scalar
    """1 where a muscle gets hotter than the firmware allows, where the error of the last quarter exceeds
    RUNAWAY times that of a joint that stays at zero, or where a response is not finite."""


def _rms(values: Array, weight: Array) -> Scalar:
    return jnp.sqrt((weight * values**2).sum() / weight.sum())


def _last_outside(course: Course, error: Array, stretch: Array, period: float) -> Scalar:
    """Longest time since a jump at which the error is outside BAND."""
    outside = stretch & (jnp.abs(error) > BAND)
    last = jnp.max(jnp.where(outside, course.since + 1, 0))
    ends = jnp.concatenate([course.since[1:] < course.since[:-1], jnp.ones(1, bool)])
    time = jnp.where((outside & ends).any(), jnp.inf, last * period)
    return jnp.where(stretch.any(), time, jnp.nan)


def _jumped(course: Course, angle: Array, period: float) -> tuple[Scalar, Scalar]:
    """Rise time of the first jump of the setpoint, and the largest overshoot of all."""
    setpoint, turned = course.setpoint, course.turned
    first = jnp.argmax(turned)
    start = jnp.where(first > 0, setpoint[jnp.maximum(first - 1, 0)], 0.0)
    size = setpoint[first] - start
    share = (angle - start) / jnp.where(turned.any(), size, 1.0)
    index = jnp.arange(angle.size)

    def reached(level: float) -> Scalar:
        there = (share >= level) & (index >= first)
        return jnp.where(there.any(), jnp.argmax(there), jnp.inf)

    rise = (reached(0.9) - reached(0.1)) * period
    over = jnp.max(jnp.where(turned, course.towards * (angle - setpoint), 0.0))
    nothing = jnp.where(turned.any(), 0.0, jnp.nan)
    rise = jnp.where(jnp.isfinite(reached(0.9)), rise, jnp.inf)
    return rise + nothing, jnp.maximum(over, 0.0) + nothing


def metrics(course: Course, trace: Trace, period: float) -> Metrics:
    """Metrics of one response."""
    angle, setpoint = trace.angle, course.setpoint
    error, index = setpoint - angle, jnp.arange(trace.angle.size)
    judged = 1.0 * (index >= course.judged_from)
    last_quarter = 1.0 * (index >= 3 * angle.size // 4)
    rise, over = _jumped(course, angle, period)
    summed = jax.ops.segment_sum(jnp.where(course.late, error, 0.0), course.late_of, MOST_JUMPS)
    counted = jax.ops.segment_sum(1.0 * course.late, course.late_of, MOST_JUMPS)
    steady = jnp.max(jnp.abs(summed) / jnp.maximum(counted, 1.0))
    peak = jnp.max(trace.temperature)
    lost = ~(_rms(error, last_quarter) <= RUNAWAY * _rms(setpoint, last_quarter))
    return Metrics(
        rise_time=rise,
        settling_time=_last_outside(course, error, course.turned, period),
        overshoot=over,
        steady_error=jnp.where(course.late.any(), steady, jnp.nan),
        recovery_time=_last_outside(course, error, course.loaded, period),
        tracking=_rms(error, judged) / _rms(setpoint, judged),
        peak_temperature=peak,
        energy=period * (trace.duty / FULL_DUTY).sum(),
        runaway=1.0 * (lost | ~(peak <= SAFE_TEMPERATURE)),
    )
