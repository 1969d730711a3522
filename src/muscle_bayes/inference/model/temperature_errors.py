"""Errors in variables: what a thermometer's error adds to the variance of readings, to first order."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.model.lane_model import Values
from muscle_bayes.inference.model.lanes import Lanes
from muscle_bayes.inference.model.problem import Data, Problem
from muscle_bayes.inference.running.programs import solved_at, unconstrained

STEP = 0.5
"""Change of temperature on either side by which a reading's response to it is found, C."""
STEEPEST = 3.0
"""Responses beyond this many times their ninth decile are cut: slips of a rotor are no slopes."""


def _warmer(lanes: Lanes, side: int, step: float) -> Lanes:
    """The lanes with another temperature of one side."""
    shift = jnp.zeros(2).at[side].set(step)
    schedule = replace(lanes.schedule, temperature=lanes.schedule.temperature + shift)
    if lanes.fine is None:
        return lanes._replace(schedule=schedule)
    inner = lanes.fine.schedule
    inner = replace(inner, temperature=inner.temperature + shift)
    return lanes._replace(schedule=schedule, fine=lanes.fine._replace(schedule=inner))


def _readings(values: Values, problem: Problem, lanes: tuple[Lanes, ...]) -> list[Array]:
    data: Data = problem.data._replace(lanes=lanes)
    draws = {name: jnp.asarray(values[name])[None] for name, _ in problem.layout.shapes}
    vector = unconstrained(draws, problem.layout, data)[0]
    return [one.averaged for one in solved_at(vector, problem.layout, data).responses]


def response_to_temperature(
    problem: Problem, values: Values, side: int, step: float = STEP
) -> list[Float[np.ndarray, "lane interval"]]:
    """d reading / d temperature of one side, of every lane [the log's unit per C].

    By central differences at `values`: derivatives proper would miss what friction holds back.

    Args:
        problem: whose readings.
        values: at which.
        side: 0 for A, 1 for B.
        step: change of the temperature on either side, C.
    """
    above, below = (
        _readings(values, problem, tuple(_warmer(one, side, s) for one in problem.data.lanes))
        for s in (step, -step)
    )
    slopes = []
    for up, down in zip(above, below, strict=True):
        slope = np.asarray(up - down) / (2.0 * step)
        slope = np.where(np.isfinite(slope), slope, 0.0)
        limit = STEEPEST * np.quantile(np.abs(slope), 0.9, axis=-1, keepdims=True)
        slopes.append(np.clip(slope, -limit, limit))
    return slopes


def with_temperature_errors(problem: Problem, values: Values) -> Problem:
    """The problem with the variance that errors of the temperature add to its readings at `values`.

        thermal_k = sum over sides (d reading_k / d T)^2 var(T_k)

    var(T) is of the smoothed course (`records.thermometer.course_variance`). Source: Fuller, Measurement
    Error Models (1987), section 3.2. Problems without a thermometer are returned as they are.
    """
    lanes = problem.data.lanes
    noisy = [np.asarray(one.heat_variance) for one in lanes]
    if not any(variance.any() for variance in noisy):
        return problem
    thermal = [np.zeros(one.time.shape) for one in lanes]
    for side in (0, 1):
        if not any(variance[..., side].any() for variance in noisy):
            continue
        slopes = response_to_temperature(problem, values, side)
        thermal = [
            total + slope**2 * variance[..., side]
            for total, slope, variance in zip(thermal, slopes, noisy, strict=True)
        ]
    changed = tuple(
        one._replace(thermal=jnp.asarray(added)) for one, added in zip(lanes, thermal, strict=True)
    )
    return replace(problem, data=problem.data._replace(lanes=changed))
