"""The surrogate of the posterior, against the posterior itself."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import muscle_bayes as mb
from muscle_bayes.inference.model.problem import Problem, pose
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.running.programs import potential_at
from muscle_bayes.inference.sampling.gibbs_blocks import blocks_of
from muscle_bayes.inference.sampling.normal import Normal, normal_at
from muscle_bayes.inference.sampling.quadratic import Expansion, expanded, surrogate_of
from muscle_bayes.inference.search.mode import find_mode


@pytest.fixture(scope="module")
def posed() -> tuple[Problem, Normal, Expansion]:
    @double_precision
    def made() -> tuple[Problem, Normal, Expansion]:
        problem = pose(mb.load_example("springs")[:2])
        mode = find_mode(jax.random.key(0), problem.layout, problem.data)
        smooth = blocks_of([name for name, _ in problem.layout.shapes]).smooth
        normal = normal_at(mode, problem.layout, smooth)
        return problem, normal, expanded(normal.point, normal.entries, normal.covariance, problem)

    return made()


@double_precision
def excess(posed: tuple[Problem, Normal, Expansion], vectors: np.ndarray) -> np.ndarray:
    """By how much the log density is above the surrogate's, which has no constant left out."""
    problem, normal, about = posed
    layout, data = problem.layout, problem.data
    surrogate = surrogate_of(layout, normal.entries)(about, data)

    @jax.jit
    def log_density(vector: jax.Array) -> jax.Array:
        return surrogate.log_density(surrogate.under(vector)[0], vector, jnp.ones(()))

    return np.array(
        [
            -float(potential_at(jnp.asarray(v), layout, data)) - float(log_density(jnp.asarray(v)))
            for v in vectors
        ]
    )


def test_at_its_point_it_is_the_density_under_any_noise(posed) -> None:
    _, normal, _ = posed
    noisy = np.tile(normal.point, (8, 1))
    others = np.setdiff1d(np.arange(normal.point.size), normal.entries)
    noisy[:, others] += np.random.default_rng(0).normal(0.0, 0.7, (8, others.size))
    assert others.size == 3
    np.testing.assert_allclose(excess(posed, noisy), 0.0, atol=1e-6)


def test_as_far_away_as_draws_are_it_is_nearly_the_density(posed) -> None:
    _, normal, _ = posed
    draws = np.tile(normal.point, (20, 1))
    kicks = np.random.default_rng(1).normal(size=(20, normal.entries.size))
    draws[:, normal.entries] += kicks @ np.linalg.cholesky(normal.covariance).T
    assert np.abs(excess(posed, draws)).max() < 0.2
