"""The course of a temperature behind a meter's held, rounded and noisy readings."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

LONGEST_HOLD = 3.0
"""Changes that follow each other within this may tell a meter's period, s."""
WINDOW = 1.5
"""Readings within this of an instant tell its temperature, s: long enough for some seven updates of
a meter, short against the peaks at which friction makes the rotor turn back."""
WIDEST = 4.0 * WINDOW
"""Most of this, where one value is shown again and again, s."""
LEAST_READINGS = 5
"""A slower meter's window spans as many updates; where a gap leaves fewer, a line bridges it."""


class Course(NamedTuple):
    """Temperature and its derivatives."""

    value: Float[np.ndarray, " instant"]
    """C."""
    rate: Float[np.ndarray, " instant"]
    """C/s."""
    curvature: Float[np.ndarray, " instant"]
    """C/s^2."""


def updates(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """When a meter measured, and what: the log repeats each value until the next.

    A meter that holds its value for several rows changes it somewhere between a row and the one before, on
    average half a row ago; one with a new value in every row is read then.
    Repeats stand for measurements that gave the same value again, one every period (that of the
    changes in quick succession): spread over the time until the next change, they have no lag. Taking
    all rows would make the temperature lag by half a period, taking changes alone would tell of
    temperatures that have just passed the middle between two values. After a gap in the rows nobody
    knows when a new value came: it counts from its next measurement on.
    """
    if time.size < 2:
        return time, values
    rows = np.diff(time)
    usual = float(np.median(rows))
    first = np.flatnonzero(np.diff(values) != 0.0) + 1
    spacing = np.diff(time[first])
    quick = spacing[spacing <= LONGEST_HOLD]
    if (
        quick.size
    ):  # multiples of the period, now and then less: of those near the shortest, the middle
        quick = quick[quick <= 1.5 * np.quantile(quick, 0.1)]
    period = max(float(np.median(quick)) if quick.size else usual, usual)
    unsure = 0.5 * period if period > 1.5 * usual else 0.0
    dated = rows[first - 1] <= max(0.5 * period, 1.5 * usual)
    came = time[first] - (0.5 * rows[first - 1] if unsure else 0.0)
    begun = np.r_[time[0], np.where(dated, came, np.nan)]
    ended = np.r_[np.where(dated, came, np.nan), np.nan]
    seen = time[np.r_[0, first]], time[np.r_[first, time.size] - 1]
    when, which = [], []
    for number, (begin, end, early, late) in enumerate(zip(begun, ended, *seen, strict=True)):
        if np.isfinite(begin) and np.isfinite(end):
            count = max(round((end - begin) / period), 1)
            instants = begin + (end - begin) / count * np.arange(count)
        elif np.isfinite(begin):
            instants = np.arange(begin, max(late - unsure, begin) + 0.5 * usual, period)
        elif np.isfinite(end):
            instants = np.arange(end - period, early, -period)[::-1]
        else:
            instants = np.arange(early + unsure, late - unsure, period)
        when.append(instants)
        which.append(np.full(instants.size, number))
    instants, owner = np.concatenate(when), np.concatenate(which)
    following = np.minimum(np.searchsorted(time, instants), time.size - 1)
    logged = time[following] - instants <= max(period, usual)
    return instants[logged], values[np.r_[0, first]][owner][logged]


def _shown(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Instants at which a meter's updates change, from the first update to the last."""
    changes = np.flatnonzero(np.diff(values)) + 1
    return np.r_[time[0], 0.5 * (time[changes] + time[changes - 1]), time[-1]]


def _half_widths(time: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Updates within this of an instant tell its temperature, s.

    WINDOW, or as far as slow meters need. Where a value is shown again and again, as far as those before
    and after it are: else a temperature that drifts past a meter's steps would climb stairs.
    """
    shown = _shown(time, values)
    number = np.searchsorted(shown, at, side="right") - 1
    begun, ended = (shown[np.clip(number + k, 0, shown.size - 1)] for k in (-1, 2))
    slow = 0.5 * LEAST_READINGS * float(np.median(np.diff(time)))
    return np.maximum(np.minimum(np.minimum(at - begun, ended - at), WIDEST), max(WINDOW, slow))


def course(time: np.ndarray, values: np.ndarray, at: np.ndarray) -> Course:
    """Local quadratic regression of the updates, with Epanechnikov weights.

    A local mean or line would cut the peaks by curvature WINDOW^2 / 10.
    """
    time, values = updates(time, values)
    line = np.interp(at, time, values)
    if time.size < LEAST_READINGS:
        return Course(line, np.zeros(at.size), np.zeros(at.size))
    width = _half_widths(time, values, at)
    first, last = np.searchsorted(time, at - width), np.searchsorted(time, at + width)
    members = first[:, None] + np.arange(max(int((last - first).max()), 1))
    inside = members < last[:, None]
    members = np.minimum(members, time.size - 1)
    x = np.where(inside, (time[members] - at[:, None]) / width[:, None], 0.0)
    weight = np.where(inside, np.maximum(1.0 - x**2, 1e-6), 0.0)
    powers = np.stack([np.ones_like(x), x, x**2], axis=-1)
    moments = np.einsum("nk,nki,nkj->nij", weight, powers, powers)
    right = np.einsum("nk,nki,nk->ni", weight, powers, values[members] - line[:, None])
    # Where a gap leaves too few readings, a slope from both its ends takes the parabola's place.
    slope = np.interp(at, 0.5 * (time[1:] + time[:-1]), np.diff(values) / np.diff(time))
    tells = (inside.sum(1) >= LEAST_READINGS - 1) & (
        np.abs(x).min(1, where=inside, initial=1.0) < 0.5
    )
    safe = np.where(tells[:, None, None], moments, np.eye(3))
    value, rate, half_curvature = np.linalg.solve(safe, right[..., None])[..., 0].T
    return Course(
        np.where(tells, line + value, line),
        np.where(tells, rate / width, slope),
        np.where(tells, 2.0 * half_curvature / width**2, 0.0),
    )


def deceleration(time: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """How heating or cooling slows down towards a turn [C/s^2], with the sign of the rate.

    -curvature where it opposes the rate of one WINDOW ago, at most that rate per WINDOW (so that a
    kink after standstill does not count); else zero.
    """
    incoming = course(time, values, np.maximum(at - WINDOW, time[0])).rate
    slowing = -course(time, values, at).curvature
    size = np.minimum(np.abs(slowing), np.abs(incoming) / WINDOW)
    return np.where(incoming * slowing > 0.0, np.sign(incoming) * size, 0.0)


EQUIVALENT = 1.25
"""Integral of the squared equivalent kernel of local quadratic regression with Epanechnikov weights.
Source: Fan and Gijbels, Local Polynomial Modelling and Its Applications (1996), table 3.3."""


def meter_noise(time: np.ndarray, values: np.ndarray) -> float:
    """Standard deviation of one measurement of a thermometer [C]: noise and resolution.

    From third differences of its updates, which a smooth course does not have; at least that of
    rounding to the finest step between values. 0 of a temperature that never changes.
    """
    _, seen = updates(time, values)
    third = np.diff(seen, 3)
    spread = 1.4826 * float(np.median(np.abs(third))) / np.sqrt(20.0) if third.size else 0.0
    rounding = _rounding(seen)
    return max(spread, rounding) if rounding else 0.0


def _rounding(seen: np.ndarray) -> float:
    """Standard deviation of rounding to the finest step between a meter's values [C]."""
    levels = np.unique(seen)
    return float(np.min(np.diff(levels))) / np.sqrt(12.0) if levels.size >= 3 else 0.0


def course_variance(
    time: np.ndarray, values: np.ndarray, at: np.ndarray
) -> Float[np.ndarray, " instant"]:
    """Variance of `course` at some instants [C^2].

        var = s^2 S(p) + r^4 / s^2 (S(t) - S(p)),      S(x) = min(1, R x / h)

    s: `meter_noise`; p: time between updates; h: half width of the window. Where noise is large, every
    update has another error r of rounding; without noise it lasts for t, as long as a value is shown.
    """
    when, seen = updates(time, values)
    noise, rounding = meter_noise(time, values), _rounding(seen)
    if when.size < LEAST_READINGS or not rounding:
        return np.zeros(at.size)
    shown, width = _shown(when, seen), _half_widths(when, seen, at)
    number = np.searchsorted(shown, at, side="right") - 1
    lasts = np.diff(shown)[np.clip(number, 0, shown.size - 2)]
    brief = np.minimum(EQUIVALENT * float(np.median(np.diff(when))) / width, 1.0)
    long = np.maximum(np.minimum(EQUIVALENT * lasts / width, 1.0), brief)
    return noise**2 * brief + rounding**4 / noise**2 * (long - brief)
