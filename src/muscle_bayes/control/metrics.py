"""What is asked of a closed loop's response."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.control.closed_loop import Trace
from muscle_bayes.control.heater import FULL_DUTY
from muscle_bayes.control.scenario import Course
from muscle_bayes.physics.linkage import Scalar

SAFE_TEMPERATURE = 110.0
"""Highest temperature that the bench's firmware lets pass [C]."""
RUNAWAY = 1.1
"""Error of a runaway, as a multiple of what staying at zero would leave."""
SETTLED = 0.05
"""Band of a settled step, share of its size."""


class Metrics(NamedTuple):
    """Of one response. NaN where the scenario has nothing of the kind, or it never comes to pass."""

    rise_time: Scalar
    """From 10 to 90 % of a step [s]."""
    overshoot: Scalar
    """Beyond a step's end, share of its size."""
    settling_time: Scalar
    """From a step to the last time outside 5 % of it [s]."""
    steady_error: Scalar
    """Mean of setpoint - angle over the last tenth, of a repeating setpoint over the last tenths of the
    last cycle's halves, weighted with the setpoint's sign [rad]."""
    drift: Scalar
    """Growth of that error from cycle to cycle, least squares [rad / cycle]."""
    tracking_error: Scalar
    """RMS of setpoint - angle [rad]."""
    disturbance: Scalar
    """Largest distance from the setpoint once a load changes [rad]."""
    ripple: Scalar
    """Standard deviation of the angle in the last quarter; of steps only [rad]."""
    energy: Scalar
    """Heating of both muscles together [s at full power]."""
    peak_temperature: Scalar
    """C"""
    limit_share: Scalar
    """Share of the time at which a heater is at full duty."""
    unstable: Scalar
    """1 where the last quarter's RMS error exceeds the setpoint's own by a tenth: the loop adds error to
    what a joint that stays at zero would have; or where a response is not finite."""
    unsafe: Scalar
    """1 where a muscle gets hotter than the firmware allows."""


def _rms(values: Array, weight: Array) -> Scalar:
    return jnp.sqrt((weight * values**2).sum() / weight.sum())


class _Step(NamedTuple):
    """A setpoint that jumps once and the response until a load comes."""

    is_one: Array
    since: Array
    size: Scalar
    share: Array
    """Response over the step's size."""
    within: Array
    """Periods after the step and before a load."""


def _step(course: Course, angle: Array) -> _Step:
    setpoint, index = course.setpoint, jnp.arange(angle.size)
    jumps = jnp.concatenate([jnp.zeros(1, bool), jnp.diff(setpoint) != 0.0])
    is_one = jumps.sum() == 1
    since = jnp.argmax(jumps)
    loaded = jnp.concatenate([jnp.zeros(1, bool), jnp.diff(course.load) != 0.0])
    until = jnp.where(loaded.any(), jnp.argmax(loaded), angle.size)
    size = setpoint[-1] - setpoint[0]
    share = (angle - setpoint[0]) / jnp.where(is_one, size, 1.0)
    # A load that changes from the beginning leaves the step's response to be judged with it.
    until = jnp.where(until <= since, angle.size, until)
    return _Step(is_one, since, size, share, (index >= since) & (index < until))


def _rise_and_settling(one: _Step, period: float) -> tuple[Scalar, Scalar, Scalar]:
    def first(reached: Array) -> Scalar:
        return jnp.where((reached & one.within).any(), jnp.argmax(reached & one.within), jnp.nan)

    rise = (first(one.share >= 0.9) - first(one.share >= 0.1)) * period
    over = jnp.maximum(jnp.max(jnp.where(one.within, one.share, -jnp.inf)) - 1.0, 0.0)
    outside = one.within & (jnp.abs(one.share - 1.0) > SETTLED)
    index = jnp.arange(one.share.size)
    last = jnp.max(jnp.where(outside, index, one.since))
    end = jnp.max(jnp.where(one.within, index, 0))
    settling = jnp.where(last >= end, jnp.nan, (last + 1 - one.since) * period)
    nothing = jnp.where(one.is_one, 0.0, jnp.nan)
    return rise + nothing, over + nothing, settling + nothing


def cycle_errors(course: Course, error: Array, cycles: int) -> Float[Array, " cycle"]:
    """Mean error towards the setpoint's side in the last tenths of the halves of each cycle."""
    index = jnp.arange(error.size)
    length = jnp.maximum(course.cycle, 1)
    place = (index % length) / length
    late = ((place >= 0.45) & (place < 0.5)) | (place >= 0.95)
    towards = error * jnp.sign(course.setpoint)
    one = jnp.stack([late & (index // length == n) for n in range(cycles)])
    return (one * towards).sum(1) / jnp.maximum(one.sum(1), 1)


def metrics(course: Course, trace: Trace, period: float, cycles: int) -> Metrics:
    """Metrics of one response; `cycles` is how often the setpoint repeats, 0 where it does not."""
    angle, setpoint = trace.angle, course.setpoint
    error, index = setpoint - angle, jnp.arange(trace.angle.size)
    judged = 1.0 * (index >= course.judged_from)
    last_quarter = 1.0 * (index >= 3 * angle.size // 4)
    one = _step(course, angle)
    rise, over, settling = _rise_and_settling(one, period)
    if cycles:
        errors = cycle_errors(course, error, cycles)
        place = jnp.arange(cycles) - 0.5 * (cycles - 1)
        steady, drift = errors[-1], (place * errors).sum() / (place**2).sum()
    else:
        tail = 1.0 * (index >= 9 * angle.size // 10)
        still = jnp.where(one.is_one, 0.0, jnp.nan)
        steady, drift = (tail * error).sum() / tail.sum() + still, jnp.nan * still
    changes = jnp.concatenate([jnp.zeros(1, bool), jnp.diff(course.load) != 0.0])
    settled = jnp.maximum(jnp.argmax(changes), one.since + angle.size // 4)
    hit = changes.any() & (index >= settled)
    disturbance = jnp.where(changes.any(), jnp.max(jnp.where(hit, jnp.abs(error), 0.0)), jnp.nan)
    middle = (last_quarter * angle).sum() / last_quarter.sum()
    ripple = _rms(angle - middle, last_quarter) + jnp.where(one.is_one, 0.0, jnp.nan)
    at_zero = _rms(setpoint, last_quarter)
    runs_away = ~(_rms(error, last_quarter) <= RUNAWAY * at_zero)
    peak = jnp.max(trace.temperature)
    return Metrics(
        rise_time=rise,
        overshoot=over,
        settling_time=settling,
        steady_error=steady,
        drift=drift,
        tracking_error=_rms(error, judged),
        disturbance=disturbance,
        ripple=ripple,
        energy=period * (trace.duty / FULL_DUTY).sum(),
        peak_temperature=peak,
        limit_share=(trace.duty >= FULL_DUTY).any(axis=1).mean(),
        unstable=1.0 * runs_away,
        unsafe=1.0 * ~(jnp.isfinite(trace.temperature).all() & (peak <= SAFE_TEMPERATURE)),
    )
