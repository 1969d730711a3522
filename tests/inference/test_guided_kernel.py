"""Trajectories along a surrogate: draws are of the model's posterior whatever the surrogate."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.inference import sampler, surrogate
from muscle_bayes.inference.lane_model import LanePrediction
from muscle_bayes.inference.optimise import find_mode
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.preparation import prepare
from muscle_bayes.inference.problem import pose
from muscle_bayes.inference.programs import potential_at, predictions_at
from muscle_bayes.inference.sampler import Effort, draw
from muscle_bayes.inference.surrogate import first_surrogate, surrogate_of
from muscle_bayes.inference.whitening_at_mode import whitening

DATA = Path(__file__).parents[2] / "data"
EFFORT = Effort(warmup=120, draws=250, rounds=12)


def fitted_run(name):
    with jax.enable_x64(True):
        problem = pose(read_runs([DATA / f"{name}.csv"]))
        return problem, find_mode(jax.random.key(0), problem.layout, problem.data)


@pytest.fixture(scope="module")
def spring():
    return fitted_run("spring-1")


def drawn(spring, seed):
    problem, mode = spring
    preparation = prepare(problem.layout, problem.data)
    found = draw(
        jax.random.key(seed), mode, preparation, problem.layout, problem.data, EFFORT, workers=2
    )
    return found, found.vector.reshape(-1, found.vector.shape[-1])


def linear_predictions(x: np.ndarray) -> list[LanePrediction]:
    middle, slope = np.arange(6.0).reshape(2, 3), np.ones((2, 3, 2)) * [0.5, -2.0]
    return [LanePrediction(middle + slope @ x, None, np.ones(2))]


def test_what_is_linear_is_found_exactly():
    rng = np.random.default_rng(0)
    x = rng.standard_normal((12, 2))
    found = surrogate_of(x, [linear_predictions(one) for one in x], [None])
    there = np.array([1.5, -0.3])
    np.testing.assert_allclose(
        found.at(jnp.asarray(there))[0].reading, linear_predictions(there)[0].reading, atol=1e-6
    )


def test_points_that_cannot_be_simulated_are_left_out():
    rng = np.random.default_rng(1)
    x = rng.standard_normal((12, 2))
    predicted = [linear_predictions(one) for one in x]
    predicted[3] = [predicted[3][0]._replace(reading=np.full((2, 3), np.nan))]
    predicted[7] = [predicted[7][0]._replace(reading=np.full((2, 3), 1e6), finite=np.zeros(2))]
    found = surrogate_of(x, predicted, [None])
    np.testing.assert_allclose(found.slope[0].reading[1, 2], [0.5, -2.0], atol=1e-6)


@double_precision
def test_points_beyond_an_edge_do_not_tilt_the_first_slopes(spring, monkeypatch):
    """As where a rotor leaves the dead band that it began in, and all readings jump."""
    problem, mode = spring
    layout, data = problem.layout, problem.data
    white = whitening(mode, layout, data)
    arguments = jax.random.key(3), white, layout, data
    smooth = first_surrogate(*arguments).slope[0].reading
    edge = float(mode.vector[0]) + float(1.0 / np.sqrt(mode.information[0, 0]))
    beyond = 0

    def jumping(vector, layout, data):
        nonlocal beyond
        found = predictions_at(vector, layout, data)
        far = float(vector[0]) > edge
        beyond += far
        return [one._replace(reading=one.reading + 100.0 * far) for one in found]

    monkeypatch.setattr(surrogate, "predictions_at", jumping)
    found = first_surrogate(*arguments).slope[0].reading
    assert beyond > 0
    np.testing.assert_allclose(found, smooth, atol=0.05 * np.abs(smooth).max())


def test_a_coordinate_that_does_not_vary_has_no_slope():
    x = np.random.default_rng(2).standard_normal((12, 2)) * [1.0, 0.0]
    found = surrogate_of(x, [linear_predictions(one) for one in x], [None])
    np.testing.assert_allclose(found.slope[0].reading[0, 0], [0.5, 0.0], atol=1e-6)


@pytest.mark.parametrize(
    "name", ["spring-1", pytest.param("staircase-166g", marks=pytest.mark.slow)]
)
@double_precision
def test_a_chain_s_energies_and_predictions_are_the_model_s(name, monkeypatch):
    """Also where minimum forces move."""
    fitted = fitted_run(name)
    problem, _ = fitted
    seen = []
    advance = sampler._GuidedChains.advance

    def watched(self, step, count):
        found = advance(self, step, count)
        seen.append((self, found))
        return found

    monkeypatch.setattr(sampler._GuidedChains, "advance", watched)
    drawn(fitted, 3)
    chains, found = seen[-1]
    for state, vectors, densities in zip(
        chains._states, found.vector, found.log_density, strict=True
    ):
        last = vectors[-1]
        assert densities[-1] == pytest.approx(
            -potential_at(jnp.asarray(last), problem.layout, problem.data), abs=1e-6
        )
        np.testing.assert_array_equal(state.vector, last)
        exact = predictions_at(jnp.asarray(last), problem.layout, problem.data)[0].reading
        np.testing.assert_allclose(state.predicted[0].reading, exact, atol=1e-6)


@double_precision
def test_a_poor_surrogate_changes_no_draw_s_distribution(spring, monkeypatch):
    """Slopes a fifth too large lower the acceptance, and leave means and spreads as they are."""
    good, vectors = drawn(spring, 4)
    learned = sampler.learned_surrogate

    def worse(*arguments):
        found = learned(*arguments)
        return found._replace(slope=jax.tree.map(lambda one: 1.2 * one, found.slope))

    monkeypatch.setattr(sampler, "learned_surrogate", worse)
    bad, others = drawn(spring, 5)
    assert bad.acceptance.mean() < good.acceptance.mean() - 0.02
    spread = vectors.std(axis=0)
    np.testing.assert_allclose(
        others.mean(axis=0) / spread, vectors.mean(axis=0) / spread, atol=0.25
    )
    np.testing.assert_allclose(others.std(axis=0) / spread, 1.0, atol=0.25)


@double_precision
def test_a_useless_surrogate_is_given_up(spring, monkeypatch):
    first = sampler.first_surrogate

    def useless(*arguments):
        found = first(*arguments)
        return found._replace(slope=jax.tree.map(lambda one: -10.0 * one, found.slope))

    monkeypatch.setattr(sampler, "first_surrogate", useless)
    monkeypatch.setattr(
        sampler, "learned_surrogate", lambda *_: pytest.fail("the surrogate was kept")
    )
    found, vectors = drawn(spring, 6)
    assert found.acceptance.mean() > sampler.FAITHFUL
    assert np.isfinite(vectors).all()
