"""Moves of the noise parameters: the map they propose in, and the density they leave as it is."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.density import constrain, potential, potential_given
from muscle_bayes.inference.lane_model import predictions
from muscle_bayes.inference.noise_moves import (
    WIDENING,
    Proposal,
    entries_of,
    move_noise,
    proposal_at_mode,
    shape_of,
)
from muscle_bayes.inference.optimise import find_mode
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.problem import pose

DATA = Path(__file__).parents[2] / "data"


@double_precision
def test_shape_is_a_bijection_of_constant_volume():
    entries = jnp.array([-1.0, -2.5, 0.3, 0.4, 0.1, 2.0])
    np.testing.assert_allclose(entries_of(shape_of(entries)), entries, rtol=1e-12)
    for at in (entries, entries + jnp.array([3.0, -1.0, 0.0, -2.0, 4.0, 1.0])):
        slope = jax.jacfwd(shape_of)(at)
        np.testing.assert_allclose(np.abs(np.linalg.det(slope)), 4.0, rtol=1e-10)


@double_precision
def test_the_first_proposal_is_as_wide_as_the_information_says():
    """Of well-told entries: draws, taken back, have WIDENING times their standard deviations."""
    entries = np.array([-1.0, -0.5, 0.3])
    random = np.random.default_rng(0)
    mixing = 1e-3 * random.normal(size=(3, 3))
    proposal = proposal_at_mode(entries, np.linalg.inv(mixing @ mixing.T))
    kicks = random.normal(size=(200_000, 3))
    points = proposal.centre + kicks @ np.asarray(proposal.factor).T
    drawn = np.asarray(jax.vmap(entries_of)(points))
    np.testing.assert_allclose(drawn.mean(axis=0), entries, atol=1e-4)
    covariance = WIDENING**2 * mixing @ mixing.T
    np.testing.assert_allclose(np.cov(drawn.T), covariance, atol=0.02 * covariance.max())


@pytest.fixture(scope="module")
def spring():
    problem = pose(read_runs([DATA / "spring-1.csv"]))
    mode = double_precision(find_mode)(jax.random.key(0), problem.layout, problem.data)
    return problem, mode.vector


@double_precision
def test_potential_given_its_predictions_is_the_potential(spring):
    problem, vector = spring
    layout, data = problem.layout, problem.data
    predicted = predictions(constrain(vector, layout, data), layout, data)
    other = vector.at[blocks(layout).noise].add(0.3)
    np.testing.assert_allclose(
        potential_given(predicted, other, layout, data), potential(other, layout, data), rtol=1e-12
    )


@double_precision
@pytest.mark.parametrize(("shift", "width"), [(0.0, 1.0), (0.7, 0.6)])
def test_moves_leave_the_density_as_it_is_whatever_they_propose(spring, shift, width):
    problem, vector = spring
    layout, data = problem.layout, problem.data
    noise = blocks(layout).noise
    predicted = predictions(constrain(vector, layout, data), layout, data)

    # Exact mean and spread of log total noise by importance sampling with very many draws.
    centre = shape_of(vector[noise])
    key_grid, key_chain = jax.random.split(jax.random.key(1))
    spread = jnp.array([0.3, 2.5, 1.5])
    kicks = jax.random.normal(key_grid, (40_000, 3))
    points = centre + spread * kicks

    def energy(point):
        return potential_given(predicted, vector.at[noise].set(entries_of(point)), layout, data)

    log_weight = -jax.jit(lambda x: jax.lax.map(energy, x, batch_size=500))(points)
    weight = jax.nn.softmax(log_weight + 0.5 * jnp.sum(kicks**2, axis=1))
    assert 1.0 / jnp.sum(weight**2) > 400
    mean = weight @ points[:, 0]
    sd = jnp.sqrt(weight @ (points[:, 0] - mean) ** 2)

    proposal = Proposal(centre + shift * spread * 0.3, jnp.diag(width * 0.5 * spread))

    def step(at, key):
        moved = move_noise(key, predicted, at, proposal, layout, data)
        at = moved.vector
        off = moved.energy - potential_given(predicted, at, layout, data)
        return at, (shape_of(at[noise])[0], off)

    keys = jax.random.split(key_chain, 3000)
    _, (totals, off) = jax.jit(lambda start: jax.lax.scan(step, start, keys))(vector)
    np.testing.assert_allclose(off, 0.0, atol=1e-8)
    assert abs(totals[200:].mean() - mean) < 0.2 * sd
    np.testing.assert_allclose(totals[200:].std(), sd, rtol=0.2)
