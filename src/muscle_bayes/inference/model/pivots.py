"""Pivots of segments: their most probable starts, about which the response to a start is linear."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.inference.model.lane_model import Values
from muscle_bayes.inference.model.likelihood import noise_of
from muscle_bayes.inference.model.noise import elapsed_time, reading_variance, whiten
from muscle_bayes.inference.model.problem import Data, Lanes, Layout
from muscle_bayes.inference.running.programs import constrained_at, predictions_at

ROUNDS = 8
"""Gauss-Newton steps; where motion sticks or reverses, the response bends."""
SHARES = 1.0, 0.5, 0.25, 0.1
"""Shares of a step that are tried; the best is taken."""


class _Fit(NamedTuple):
    energy: Float[Array, " lane"]
    """Negative log density of each lane's pivot, up to a constant."""
    step: Float[Array, "lane 2"]
    """Gauss-Newton step of each lane's pivot."""


@partial(jax.jit, static_argnames="regime")
def _fit(
    reading: Float[Array, "lane interval"],
    reach: Float[Array, "lane interval 2"],
    values: Values,
    lanes: Lanes,
    regime: str,
) -> _Fit:
    """How well each lane's pivot explains its readings, and where to look for a better one."""
    noise = noise_of(values, regime)

    def one(lane: Lanes, reading: Array, reach: Array) -> _Fit:
        variance = reading_variance(noise, lane.weight, lane.coarse, lane.quantum)
        seen = (lane.weight > 0).astype(lane.reading.dtype)
        residual = lane.reading - reading
        columns = jnp.concatenate([residual[:, None], reach], axis=1)
        elapsed = elapsed_time(reading, lane.time, lane.jolted, noise, lane.quantum, regime)
        errors, _ = whiten(columns, elapsed, variance, lane.jolted, seen, noise)
        z, s = errors[:, 0], errors[:, 1:]
        away = (lane.pivot - lane.start) / lane.start_spread
        step = jnp.linalg.solve(jnp.eye(2) + s.T @ s, s.T @ z - away)
        energy = 0.5 * (z @ z + away @ away)
        return _Fit(jnp.nan_to_num(energy, nan=jnp.inf), lane.start_spread * step)

    return jax.vmap(one)(lanes, reading, reach)


def pivoted(vector: Float[Array, " n"], layout: Layout, data: Data) -> Data:
    """The data with every segment's pivot at its most probable start under an unconstrained vector.

    Data without segments are returned as they are.
    """
    if not any(layout.segmented):
        return data
    values = constrained_at(vector, layout, data)

    def fits(data: Data) -> list[_Fit | None]:
        predicted = predictions_at(vector, layout, data)
        return [
            None if one.reach is None else _fit(one.reading, one.reach, values, lanes, regime)
            for one, lanes, regime in zip(predicted, data.lanes, layout.regimes, strict=True)
        ]

    def moved(data: Data, now: list[_Fit | None], share: float) -> Data:
        lanes = (
            one if fit is None else one._replace(pivot=one.pivot + share * fit.step)
            for one, fit in zip(data.lanes, now, strict=True)
        )
        return data._replace(lanes=tuple(lanes))

    now = fits(data)
    for _ in range(ROUNDS):
        for trial in [moved(data, now, share) for share in SHARES]:
            data, now = _better(data, now, trial, fits(trial))
    return data


def _better(
    data: Data, now: list[_Fit | None], trial: Data, then: list[_Fit | None]
) -> tuple[Data, list[_Fit | None]]:
    """Of two sets of pivots, each lane's better one."""
    lanes, kept = [], []
    for one, fit, other, other_fit in zip(data.lanes, now, trial.lanes, then, strict=True):
        if fit is not None and other_fit is not None:
            falls = other_fit.energy < fit.energy
            one = one._replace(pivot=jnp.where(falls[:, None], other.pivot, one.pivot))
            energy = jnp.where(falls, other_fit.energy, fit.energy)
            fit = _Fit(energy, jnp.where(falls[:, None], other_fit.step, fit.step))
        lanes.append(one)
        kept.append(fit)
    return data._replace(lanes=tuple(lanes)), kept
