"""What the staircases' coordinates should be: the same equations on a grid many times finer."""

import numpy as np
from jaxtyping import Float

from benchmarks.competitors.c_floor import CFloor
from benchmarks.competitors.lsoda import Lsoda
from benchmarks.competitors.protocol import Coordinates
from benchmarks.density import means
from benchmarks.problem import Course, count_of
from muscle_bayes.inference.model.problem import Problem

FINER = 31
STRICT = 2e-5, 1e-10
"""Damping [N m s/rad] and tolerance of the independent solution."""


def refined(course: Course, times: int) -> Course:
    """The same course with each interval cut into `times`."""
    nodes = course.time[::2]
    steps = np.arange(2 * times) / (2 * times)
    inner = nodes[:-1, None] + np.diff(nodes)[:, None] * steps
    fine = np.append(inner.ravel(), nodes[-1])
    return Course(fine, np.interp(fine, course.time, course.heat))


def reference(problem: Problem, vector: Float[np.ndarray, " n"]) -> Coordinates:
    """Mean coordinates of the intervals [rad], the floor's steps FINER times finer."""
    floor = CFloor(problem)
    pairs = zip(floor.lanes, floor.inputs(vector), strict=True)
    fine = [
        floor.solve(lane._replace(course=refined(lane.course, FINER)), inputs)
        for lane, inputs in pairs
    ]
    return np.stack([means(q[::FINER]) for q in fine])


def independent(problem: Problem, vector: Float[np.ndarray, " n"]) -> Coordinates:
    """The same from the overdamped ODE by LSODA, strictly."""
    return Lsoda(problem, *STRICT).coordinates(vector)


def error(q: Coordinates, true: Coordinates, problem: Problem) -> float:
    """Root mean square difference over all runs' intervals with readings [counts]."""
    (lanes,) = problem.data.lanes
    seen = np.asarray(lanes.weight)[:, : q.shape[1]] > 0.0
    return float(np.sqrt(np.mean((q - true)[seen] ** 2)) / count_of(problem))
