"""Pivots of segments: their most probable starts, about which the response to a start is linear."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.model.density import constrain
from muscle_bayes.inference.model.lane_model import predictions
from muscle_bayes.inference.model.lanes import Lanes
from muscle_bayes.inference.model.likelihood import noise_of
from muscle_bayes.inference.model.noise import elapsed_time, reading_variance, whiten
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.running.program import program
from muscle_bayes.inference.search.least_squares import least_squares


class _Start(NamedTuple):
    """How well a lane's pivot explains its readings; in units of the start's prior."""

    potential: Array
    gradient: Float[Array, "2"]
    information: Float[Array, "2 2"]


@program
def _starts_at(vector: Float[Array, " n"], layout: Layout, data: Data) -> list[_Start | None]:
    values = constrain(vector, layout, data)
    groups = zip(predictions(values, layout, data), data.lanes, layout.regimes, strict=True)
    found: list[_Start | None] = []
    for prediction, lanes, regime in groups:
        noise = noise_of(values, regime)

        def one(lane: Lanes, reading: Array, reach: Array, noise=noise, regime=regime) -> _Start:
            variance = reading_variance(noise, lane.weight, lane.coarse, lane.quantum)
            seen = (lane.weight > 0).astype(lane.reading.dtype)
            columns = jnp.concatenate([(lane.reading - reading)[:, None], reach], axis=1)
            elapsed = elapsed_time(reading, lane.time, lane.jolted, lane.thermal, noise, regime)
            errors, _ = whiten(columns, elapsed, variance, lane.jolted, seen, noise)
            z, s = errors[:, 0], errors[:, 1:]
            away = (lane.pivot - lane.start) / lane.start_spread
            return _Start(0.5 * (z @ z + away @ away), away - s.T @ z, jnp.eye(2) + s.T @ s)

        cut = prediction.reach is not None
        found.append(jax.vmap(one)(lanes, prediction.reading, prediction.reach) if cut else None)
    return found


def pivoted(vector: Float[Array, " n"], layout: Layout, data: Data, steps: int = 8) -> Data:
    """The data with every segment's pivot at its most probable start under an unconstrained vector.

    Data without segments are returned as they are. All lanes of all groups are rows of one batch.
    """
    cut = [group for group, one in enumerate(layout.segmented) if one]
    if not cut:
        return data
    sizes = [data.lanes[group].pivot.shape[0] for group in cut]
    here = np.concatenate([np.asarray(_in_spreads(data.lanes[group])) for group in cut])

    def moved(pivots: np.ndarray) -> Data:
        lanes = list(data.lanes)
        for group, part in zip(cut, np.split(pivots, np.cumsum(sizes)[:-1]), strict=True):
            one = lanes[group]
            lanes[group] = one._replace(pivot=one.start + one.start_spread * part)
        return data._replace(lanes=tuple(lanes))

    def looker(points: Sequence[np.ndarray], index: Sequence[int]) -> list[_Start]:
        trial = here.copy()
        trial[list(index)] = points
        seen = _starts_at(vector, layout, moved(trial))
        parts = [jax.device_get(seen[group]) for group in cut]
        whole = jax.tree.map(lambda *x: np.concatenate(x), *parts)
        return [_Start(*(leaf[i] for leaf in whole)) for i in index]

    rows = least_squares(looker, list(here), (), steps, longest=np.inf)
    return moved(np.stack([row.point for row in rows]))


def _in_spreads(lanes: Lanes) -> Float[Array, "lane 2"]:
    return (lanes.pivot - lanes.start) / lanes.start_spread
