"""What muscle.stan is given: the runs as other solvers see them, priors, and the frame."""

from typing import Any

import numpy as np
from jaxtyping import Float
from numpyro import distributions as dist

from benchmarks.density import inputs_of
from benchmarks.ode import COARSE_ERROR, damping_for
from benchmarks.problem import lanes_of
from benchmarks.samplers.protocol import Frame
from benchmarks.samplers.settings import TOLERANCE
from muscle_bayes.conventions import STRAIN_EPSILON
from muscle_bayes.inference.model.muscle_prior import COLD, HOT
from muscle_bayes.inference.model.noise import AT_REST
from muscle_bayes.inference.model.problem import Problem
from muscle_bayes.physics.muscle import DAMPER_FLOOR

SHARED = (
    "J",
    "D",
    "taut_strain",
    "contraction",
    "bend",
    "modulus",
    "F_modulus_min",
    "stiffness_hyst",
    "F_hyst_min",
    "time_constant",
    "softening",
    "slow.noise",
    "slow.discrepancy",
    "slow.correlation_time",
)
EACH = ("slow.zero", "slow.start", "slow.hyst_lag")
"""Both in the order in which the program takes them from its vector, EACH once for every run."""


def _check(problem: Problem) -> None:
    """The program knows one problem: runs of one group, no effects, no jump of the load."""
    (lanes,) = problem.data.lanes
    runs = lanes.run.size
    wanted = *((name, ()) for name in SHARED), *((name, (runs,)) for name in EACH)
    if problem.layout.shapes != wanted:
        raise ValueError("muscle.stan is written for other unknowns")
    if np.any(lanes.jolted) or lanes.again is not None or np.any(lanes.run != np.arange(runs)):
        raise ValueError("muscle.stan knows each run once, under one load")


def _priors(problem: Problem) -> dict[str, np.ndarray]:
    """Location and spread of each entry's prior; of the softening's, a Beta, its two shapes apart."""
    columns, shapes = [], np.empty(0)
    for name, shape in problem.layout.shapes:
        prior = problem.data.priors[name]
        match prior:
            case dist.Normal() | dist.LogNormal():
                column = prior.loc, prior.scale
            case dist.HalfNormal() | dist.HalfCauchy():
                column = 0.0, prior.scale
            case dist.Beta():
                column = 0.0, 1.0
                shapes = np.array([prior.concentration1, prior.concentration0], float)
            case _:
                raise TypeError(f"muscle.stan knows no {type(prior).__name__}")
        size = int(np.prod(shape))
        columns.append([np.broadcast_to(np.asarray(one, float), size) for one in column])
    location, spread = np.concatenate(columns, axis=1)
    return {"location": location, "spread": spread, "softening_prior": shapes}


def data_of(problem: Problem, frame: Frame) -> dict[str, Any]:
    """The data block by name."""
    _check(problem)
    (lanes,) = problem.data.lanes
    seen = lanes_of(problem)
    intervals = np.array([lane.intervals for lane in seen])

    def joined(rows: Float[np.ndarray, "lane interval"]) -> np.ndarray:
        """Without the padding, one lane after the other."""
        return np.concatenate([row[:n] for row, n in zip(np.asarray(rows), intervals, strict=True)])

    time = np.asarray(lanes.time)
    typical = np.abs(np.asarray(inputs_of(frame.mode, problem.layout, problem.data))[0])
    rig = [
        [
            *(lane.radius, lane.anchor_x, lane.anchor_y, lane.base_length, lane.heated_fraction),
            *(lane.room_temperature, lane.torque, *lane.stops),
        ]
        for lane in seen
    ]
    return _priors(problem) | {
        "lanes": len(seen),
        "intervals": intervals,
        "time": np.concatenate([lane.course.time for lane in seen]),
        "heater": np.concatenate([lane.course.heat for lane in seen]),
        "reading": joined(lanes.reading),
        "gap": joined(np.diff(time, axis=1, prepend=time[:, :1])),
        "weight": joined(lanes.weight),
        "coarse": joined(lanes.coarse),
        "rig": np.array(rig),
        "scale": np.asarray(lanes.scale),
        "quantum": np.asarray(lanes.quantum),
        "eps": STRAIN_EPSILON,
        "damper_floor": DAMPER_FLOOR,
        "at_rest": AT_REST,
        "cold": COLD,
        "hot": HOT,
        "tension": float(problem.data.tension),
        "damping": damping_for(COARSE_ERROR),
        "tolerance": TOLERANCE,
        "typical": typical[:10],
        "size_z": frame.mode.size,
        "mode": frame.mode,
        "factor": frame.factor,
    }
