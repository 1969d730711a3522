"""Moves along ridges: exact, and as far as the posterior goes."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.inference import ridge as ridge_module
from muscle_bayes.inference.bend import Bend, bent, unbent
from muscle_bayes.inference.bend_friction import FrictionScale
from muscle_bayes.inference.bend_sizes import Sizes
from muscle_bayes.inference.blocks import blocks
from muscle_bayes.inference.density import unconstrain
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.prior_draws import prior_draws
from muscle_bayes.inference.problem import Problem, pose
from muscle_bayes.inference.ridge import offer_along_ridge, ridge_of, scattered
from muscle_bayes.inference.walled_moves import WalledState, move_walled

DATA = Path(__file__).parents[2] / "data"
BEND = Bend(
    FrictionScale(np.float64(3e-3), np.float64(1.0)),
    Sizes(np.array([3e-4, 1e-2, 1e-3, 1e-2]), np.log(0.1), np.float64(1.0)),
)
TOLD = 1e-3
"""Standard deviation of the rest, the ridge's entry given, over that of the entry."""


@pytest.fixture(scope="module")
def staircase() -> Problem:
    with jax.enable_x64(True):
        return pose(read_runs([DATA / "staircase-166g.csv"]))


def normal(problem: Problem):
    """A density that is normal in bent coordinates, its covariance, and its middle."""
    layout, data = problem.layout, problem.data
    values = prior_draws(jax.random.key(1), 1, layout, data)
    vector = unconstrain({name: value[0] for name, value in values.items()}, layout, data)
    middle = bent(vector, BEND, layout, data)
    _, outer, noise = blocks(layout)
    rng = np.random.default_rng(3)
    size, entry = middle.size, outer[0]
    direction = rng.standard_normal(size)
    direction[noise], direction[outer], direction[entry] = 0.0, 0.0, 1.0
    covariance = 1e-4 * np.outer(direction, direction) + (1e-2 * TOLD) ** 2 * np.eye(size)
    precision = jnp.asarray(np.linalg.inv(covariance))

    def energy(vector):
        away = bent(vector, BEND, layout, data) - middle
        volume = unbent(bent(vector, BEND, layout, data), BEND, layout, data).log_volume
        # A density over vectors: that of bent coordinates over their volume.
        return 0.5 * away @ precision @ away + volume

    return energy, covariance, middle, entry


@pytest.mark.parametrize("draws", [0.0, 1.0])
@double_precision
def test_an_entry_moves_with_what_it_is_told_together_with(staircase, draws, monkeypatch):
    """By steps and by draws alone; the rest is known to a thousandth of what it moves by, as sensors'
    zeros are."""
    monkeypatch.setattr(ridge_module, "ANEW", draws)
    layout, data = staircase.layout, staircase.data
    energy, covariance, middle, entry = normal(staircase)
    outer = blocks(layout).walled
    ridge = ridge_of(middle[outer], covariance[outer], layout)

    def offer_at(key, which, vector):
        return offer_along_ridge(key, which, vector, ridge, BEND, layout, data)

    def step(state, key):
        state = move_walled(key, state, energy, offer_at, layout)
        return state, bent(state.vector, BEND, layout, data)[entry]

    vector = unbent(middle, BEND, layout, data).vector
    keys = jax.random.split(jax.random.key(0), 20_000)
    start = WalledState(vector, energy(vector))
    seen = np.asarray(jax.jit(lambda s: jax.lax.scan(step, s, keys))(start)[1])
    spread = np.sqrt(covariance[entry, entry])
    np.testing.assert_allclose(seen.mean(), middle[entry], atol=0.1 * spread)
    np.testing.assert_allclose(seen.std(), spread, rtol=0.06)


@pytest.mark.parametrize("seed", range(3))
@double_precision
def test_the_way_back_of_a_step_is_weighed_by_its_jacobian(staircase, seed, monkeypatch):
    monkeypatch.setattr(ridge_module, "ANEW", 0.0)
    layout, data = staircase.layout, staircase.data
    _, covariance, middle, _ = normal(staircase)
    outer = blocks(layout).walled
    ridge = ridge_of(middle[outer], 100.0 * covariance[outer], layout)
    vector = unbent(middle, BEND, layout, data).vector
    key = jax.random.key(seed)

    def offer(vector):
        return offer_along_ridge(key, jnp.asarray(0), vector, ridge, BEND, layout, data)

    # By differences: coordinates are bent by bisection, which has no derivative.
    steps = 1e-5 * np.eye(vector.size)
    moved = jax.jit(jax.vmap(lambda step: offer(vector + step).vector))
    jacobian = (moved(steps) - moved(-steps)).T / 2e-5
    sign, log_volume = np.linalg.slogdet(np.asarray(jacobian))
    assert sign == 1.0
    assert abs(log_volume) > 0.1
    np.testing.assert_allclose(offer(vector).log_odds, log_volume, rtol=1e-3)


@double_precision
def test_points_are_scattered_along_ridges_that_are_told(staircase):
    layout = staircase.layout
    _, covariance, middle, entry = normal(staircase)
    outer = blocks(layout).walled
    wide = covariance[outer].copy()
    wide[1, outer[1]] = 1.0
    ridge = ridge_of(middle[outer], wide, layout)
    points = np.tile(np.asarray(middle), (4000, 1))
    seen = scattered(points, ridge, np.random.default_rng(0)) - points
    np.testing.assert_allclose(seen[:, entry].std(), np.sqrt(wide[0, entry]), rtol=0.05)
    np.testing.assert_allclose(seen, np.outer(seen[:, entry], ridge.direction[0]), atol=1e-12)
