"""Mean readings of intervals, and how well they are known."""

import numpy as np
import pandas as pd

from muscle_bayes.data.run import Run

FROZEN_READINGS = 20
"""Identical readings in a row that tell of a sensor without noise; fewer come about by chance."""


def means(values: np.ndarray, owner: np.ndarray, size: int) -> np.ndarray:
    """Mean of `values` for each owner 0..size-1; NaN where it owns none."""
    inside = (owner >= 0) & (owner < size)
    counts = np.bincount(owner[inside], minlength=size)
    sums = np.bincount(owner[inside], weights=values[inside], minlength=size)
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def observations(
    run: Run, owner: np.ndarray, size: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Mean time, mean reading, weight and quantisation variance of each interval's readings.

    Readings that never change share one quantisation error, however many there are. So a mean of
    identical readings keeps the error of a single one, and of a stretch of FROZEN_READINGS or more
    only the middle interval counts.
    """
    time, reading = run.table["time"].to_numpy(), run.table["reading"].to_numpy()
    inside = (owner >= 0) & (owner < size)
    rows = pd.DataFrame({"reading": reading[inside]}).groupby(owner[inside])["reading"]
    low, high = (extreme.reindex(range(size)).to_numpy() for extreme in (rows.min(), rows.max()))
    weight = np.bincount(owner[inside], minlength=size).astype(float)
    frozen = (low == high) & (weight > 0)
    coarse = np.where(frozen, 1.0, 1.0 / np.maximum(weight, 1.0)) / 12.0
    mean_time, mean = means(time, owner, size), means(reading, owner, size)
    if run.output_sensor.resolution > 0.0:
        value = np.where(frozen, low, np.arange(size) + np.nan)
        stretch = np.cumsum(np.r_[True, ~(value[1:] == value[:-1])])
        for _, members in pd.Series(np.arange(size)).groupby(stretch):
            if frozen[members.iloc[0]] and weight[members].sum() >= FROZEN_READINGS:
                keep = members.iloc[len(members) // 2]
                weight[members[members != keep]] = 0.0
    return mean_time, np.where(weight > 0, mean, 0.0), weight, coarse
