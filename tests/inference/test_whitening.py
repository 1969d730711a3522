"""Whitening where directions are told with very different precision."""

from pathlib import Path

import jax
import numpy as np

from muscle_bayes.data import read_runs
from muscle_bayes.inference import whitening_at_mode, whitening_of_draws
from muscle_bayes.inference.bend_hyst import starts
from muscle_bayes.inference.bent_rows import bent_rows, unbent_rows
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.optimise import find_mode
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.problem import pose
from muscle_bayes.inference.squeeze import Squeeze
from muscle_bayes.inference.whitening_at_mode import whitening
from muscle_bayes.inference.whitening_of_draws import rewhiten

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


@double_precision
def test_draws_teach_the_width_that_trajectories_find(monkeypatch) -> None:
    """They hold minimum forces: the sensor's zero, which moves ten times its own width with one of them,
    and a direction that is ten times as long as it was at the mode, count with their own."""
    # Such draws have starts on either side of their edges.
    for module in (whitening_at_mode, whitening_of_draws):
        monkeypatch.setattr(module, "squeeze_at", lambda *told: Squeeze.none(told[3]))
    problem = pose(read_runs([DATA / "staircase-166g.csv"]))
    layout, data = problem.layout, problem.data
    mode = find_mode(jax.random.key(0), layout, data)
    white = whitening(mode, layout, data)
    inner, outer, _ = blocks(layout)
    at, rng = starts(layout), np.random.default_rng(0)
    factor, middle = (
        np.asarray(white.factor),
        bent_rows(mode.vector[None], white.bend, layout, data),
    )
    zero, time = (list(inner).index(at[name]) for name in ("slow.zero", "time_constant"))
    z = rng.standard_normal((400, inner.size))
    long = np.zeros(inner.size)
    long[[zero, time]] = np.sqrt(0.5)
    z += 9.0 * np.outer(z @ long, long)
    alone = np.tile(middle, (len(z), 1))
    alone[:, inner] += z @ factor.T
    force = 0.01 * rng.standard_normal(len(z))
    together = alone.copy()
    together[:, outer[0]] += force
    together[:, at["slow.zero"]] += force / force.std() * 10.0 * np.linalg.norm(factor[zero])

    vectors = unbent_rows(together, white.bend, layout, data)
    fresh, _ = rewhiten(white, vectors.reshape(4, 100, -1), layout, data)
    there = bent_rows(unbent_rows(alone, white.bend, layout, data), fresh.bend, layout, data)
    seen = np.cov(np.linalg.solve(np.asarray(fresh.factor), there[:, inner].T))
    widths = np.linalg.eigvalsh(seen)
    assert widths.min() > 0.3
    assert widths.max() < 3.0
