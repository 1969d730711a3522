"""Whitening where directions are told with very different precision."""

from pathlib import Path

import jax
import numpy as np

from muscle_bayes.data import read_runs
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.optimise import find_mode
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.problem import pose
from muscle_bayes.inference.whitening import whitening

DATA = Path(__file__).parents[2] / "data"


@double_precision
def test_a_direction_that_is_told_far_better_than_others_leaves_them_a_width() -> None:
    """The plain inverse of such a matrix fails, or loses its sign by rounding."""
    problem = pose(read_runs([DATA / "spring-1.csv"]))
    mode = find_mode(jax.random.key(0), problem.layout, problem.data)
    inner = blocks(problem.layout).smooth
    told = np.array(mode.information)
    along = np.zeros(len(told))
    along[inner] = np.sqrt(np.diag(told)[inner])
    told = told + 1e16 * np.outer(along, along)
    white = whitening(mode._replace(information=told), problem.layout, problem.data)
    assert np.isfinite(np.asarray(white.factor)).all()
    assert np.diag(np.asarray(white.factor)).min() > 0.0
