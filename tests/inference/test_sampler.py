"""The sampler: what its whitening and its noise proposal learn, and when it says that chains agree."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.inference.bend import bent, unbent
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.noise_moves import Proposal, entries_of, lasting_misfit, refit, shape_of
from muscle_bayes.inference.optimise import find_mode
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.problem import pose
from muscle_bayes.inference.sampler import Draws, Effort, agree
from muscle_bayes.inference.whitening_at_mode import whitening
from muscle_bayes.inference.whitening_of_draws import rewhiten

DATA = Path(__file__).parents[2] / "data"


def test_the_misfit_that_lasts_is_its_power_at_low_frequency():
    """The integral of the covariance: discrepancy^2 exp(-|lag| / time), and noise^2 over one spacing."""
    noise, discrepancy, time = np.array([1.0, 5.0]), np.array([0.3, 2.0]), np.array([20.0, 0.1])
    spacing = np.array([0.5, 0.03])
    entries = jnp.log(jnp.stack([noise, discrepancy, time], 1)).ravel()
    lag = np.linspace(0.0, 40.0, 400_001)
    power = [
        2.0 * np.trapezoid(d**2 * np.exp(-lag), lag * t) + n**2 * every
        for n, d, t, every in zip(noise, discrepancy, time, spacing, strict=True)
    ]
    found = 2.0 * np.exp(2.0 * lasting_misfit(entries, spacing))
    np.testing.assert_allclose(found, power, rtol=1e-5)


@double_precision
def test_the_noise_proposal_moves_to_what_was_drawn():
    random = np.random.default_rng(0)
    shapes = np.array([1.0, 0.5, 2.0]) + random.normal(size=(4000, 3)) * np.array([0.1, 1.0, 0.5])
    draws = jax.vmap(entries_of)(jnp.asarray(shapes))
    narrow = Proposal(jnp.zeros(3), 1e-3 * jnp.eye(3))
    fresh = refit(narrow, draws, 1.0)
    np.testing.assert_allclose(fresh.centre, [1.0, 0.5, 2.0], atol=0.05)
    np.testing.assert_allclose(np.diag(fresh.factor), 1.3 * np.array([0.1, 1.0, 0.5]), rtol=0.05)
    kept = refit(narrow, draws, 1e9)
    np.testing.assert_allclose(kept.centre, 0.0, atol=1e-4)
    np.testing.assert_allclose(jax.vmap(shape_of)(draws), shapes, rtol=1e-9, atol=1e-9)


@pytest.fixture(scope="module")
def spring():
    problem = pose(read_runs([DATA / "spring-1.csv"]))
    mode = double_precision(find_mode)(jax.random.key(0), problem.layout, problem.data)
    return problem, mode


@double_precision
def test_whitening_learns_the_covariance_of_draws_and_leaves_chains_where_they_are(spring):
    problem, mode = spring
    layout, data = problem.layout, problem.data
    inner = blocks(layout).smooth
    white = whitening(mode, layout, data)
    random = np.random.default_rng(1)
    mixing = np.diag([3.0, 0.5, 1.0, 2.0])
    mixing[0, 1] = 0.4
    z = random.normal(size=(20_000, 4)) @ mixing.T
    points = np.tile(np.asarray(white.centre), (20_000, 1))
    points[:, inner] += z @ np.asarray(white.factor).T
    back = jax.jit(jax.vmap(lambda point: unbent(point, white.bend, layout, data).vector))
    vectors = np.asarray(back(points)).reshape(4, 5000, -1)
    fresh, last = rewhiten(white, vectors, layout, data)
    place = jax.jit(jax.vmap(lambda vector: bent(vector, fresh.bend, layout, data)))
    points = np.asarray(place(vectors.reshape(-1, len(mode.vector))))
    z = np.linalg.solve(fresh.factor, (points[:, inner] - fresh.centre[inner]).T)
    np.testing.assert_allclose(np.cov(z), np.eye(inner.size), atol=0.03)
    ends = np.asarray(place(vectors[:, -1]))
    for index in range(4):
        there = fresh.centre[inner] + fresh.factor @ last[index]
        np.testing.assert_allclose(there, ends[index, inner], rtol=1e-9)


def drawn(shift: float, count: int) -> Draws:
    random = np.random.default_rng(2)
    vector = random.normal(size=(4, count, 2)) + shift * np.arange(4)[:, None, None]
    rest = np.zeros((4, count))
    return Draws(vector, rest, rest, rest, rest, rest)


def test_chains_agree_only_where_they_are_alike_and_long_enough():
    assert agree(drawn(0.0, 1000), Effort())
    assert not agree(drawn(0.0, 80), Effort())
    assert not agree(drawn(0.3, 1000), Effort())
    assert agree(drawn(0.1, 1000), Effort(max_rhat=1.05))
    assert not agree(drawn(0.3, 1000), Effort(max_rhat=1.05))
