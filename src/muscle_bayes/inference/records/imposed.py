"""Runs whose motion is imposed."""

import numpy as np

from muscle_bayes.data.run import Run
from muscle_bayes.inference.records.averages import means, observations
from muscle_bayes.inference.records.heat import heat_at, heat_variance, switched
from muscle_bayes.inference.records.record import Record
from muscle_bayes.physics.schedule import Schedule

IMPOSED_INTERVALS = 1400
"""Most intervals into which a run of imposed motion is divided."""


def imposed_record(run: Run) -> Record:
    """Rows, or as many of them as make IMPOSED_INTERVALS bins, averaged: forces and coordinates alike.

    A mean force is that of the mean coordinate and speed, to first order, however quickly they change.
    """
    time = run.table["time"].to_numpy()
    per_bin, rows = -(-time.size // IMPOSED_INTERVALS), np.arange(time.size)
    about = switched(run)[:, None] + np.arange(3)  # a row before and a row after each jump
    begins = np.union1d(rows[::per_bin], about[about < time.size])
    owner = np.searchsorted(begins, rows, side="right") - 1
    size = int(owner[-1]) + 1
    mean_time, mean, weight, coarse = observations(run, owner, size)
    edge = np.flatnonzero(np.diff(owner))
    step = 0.5 * np.diff(time)
    nodes = np.r_[time[0] - step[0], 0.5 * (time[edge] + time[edge + 1]), time[-1] + step[-1]]
    q = run.coordinate
    slopes = np.gradient(q, time)
    ends = np.interp(nodes, time, q)
    ends[0], ends[-1] = q[0] - step[0] * slopes[0], q[-1] + step[-1] * slopes[-1]
    heat = np.stack([heat_at(run, side, nodes) for side in "ab"], 1)
    nothing = np.zeros(size)
    return Record(
        Schedule(nodes, heat, nothing, nothing),
        mean_time,
        mean,
        weight,
        coarse,
        nothing,
        float(mean[weight > 0][0]),
        0.0,
        np.zeros((nodes.size, 2)),
        heat_variance(run, nodes),
        np.stack([means(q, owner, size), np.diff(ends) / np.diff(nodes)], 1),
    )
