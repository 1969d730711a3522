"""Generalised least squares: what readings tell of parameters in which predictions are linear."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.inference.lane_model import LanePrediction, Values, zeros_of
from muscle_bayes.inference.likelihood import noise_of
from muscle_bayes.inference.noise import (
    NoiseParameters,
    elapsed_time,
    reading_variance,
    whiten,
)
from muscle_bayes.inference.problem import Data, Lanes, Layout


class Linear(NamedTuple):
    """A group's model around a point."""

    shown: Float[Array, "lane interval"]
    """What `shown` says there."""
    slope: Float[Array, "lane interval k"]
    """Derivatives of that in the parameters."""
    prediction: LanePrediction


class NormalEquations(NamedTuple):
    """Of least squares weighted by the inverse covariance of noise and discrepancy."""

    information: Float[Array, "k k"]
    """slope' covariance^-1 slope."""
    pull: Float[Array, " k"]
    """slope' covariance^-1 (reading - shown)."""


def shown(
    predicted: list[LanePrediction], values: Values, layout: Layout, data: Data
) -> list[Float[Array, "lane interval"]]:
    """Readings as the model has them, one entry a group: of segments, from their starts' prior means."""
    result = []
    groups = zip(predicted, data.lanes, layout.regimes, layout.segmented, strict=True)
    for prediction, lanes, regime, cut in groups:
        reading = zeros_of(values, lanes, regime, cut)[:, None] + prediction.reading
        if prediction.reach is not None:
            back = (lanes.start - lanes.pivot) / lanes.start_spread
            reading = reading + jnp.einsum("lij,lj->li", prediction.reach, back)
        result.append(reading)
    return result


def normal_equations(
    linear: list[Linear], values: Values, layout: Layout, data: Data
) -> NormalEquations:
    """Summed over all readings, the noise being that of the values; free starts are integrated out.

    The discrepancy's clock is taken to run as it does at the point.
    """
    parts = []
    for one, lanes, regime in zip(linear, data.lanes, layout.regimes, strict=True):
        noise = noise_of(values, regime)

        def told(lane, shown, slope, prediction, noise=noise, regime=regime):
            return _of_lane(lane, Linear(shown, slope, prediction), noise, regime)

        parts.append(jax.vmap(told)(lanes, *one))
    return NormalEquations(
        sum((part.information.sum(axis=0) for part in parts), jnp.zeros(())),
        sum((part.pull.sum(axis=0) for part in parts), jnp.zeros(())),
    )


def _of_lane(lane: Lanes, at: Linear, noise: NoiseParameters, regime: str) -> NormalEquations:
    readings = [lane.reading] if lane.again is None else [lane.reading, lane.again]
    residuals = jnp.stack([reading - at.shown for reading in readings], axis=1)
    reach = at.prediction.reach
    free = jnp.zeros((len(residuals), 0)) if reach is None else reach
    columns = jnp.concatenate([at.slope, residuals, free], axis=1)
    columns = jnp.where(jnp.isfinite(columns), columns, 0.0)
    elapsed = elapsed_time(
        at.prediction.reading, lane.time, lane.jolted, noise, lane.quantum, regime
    )
    variance = reading_variance(noise, lane.weight, lane.coarse, lane.quantum)
    seen = (lane.weight > 0).astype(columns.dtype)
    errors = whiten(columns, elapsed, variance, lane.jolted, seen, noise).errors
    count = at.slope.shape[1]
    slope, rest, free = jnp.split(errors, [count, count + len(readings)], axis=1)
    told = jnp.eye(free.shape[1]) + free.T @ free
    explained = free @ jnp.linalg.solve(told, free.T @ slope)
    slope_left = slope - explained
    return NormalEquations(len(readings) * slope.T @ slope_left, slope_left.T @ rest.sum(axis=1))
