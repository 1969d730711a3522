"""Draws of the prior, against its distributions."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro import distributions as dist
from scipy.stats import kstest

from muscle_bayes.data import read_runs
from muscle_bayes.inference.model.density import log_prior, unconstrain
from muscle_bayes.inference.model.muscle_prior import first_hyst, resting_hyst
from muscle_bayes.inference.model.prior_draws import SAMPLERS, prior_draws, sample_prior
from muscle_bayes.inference.model.priors import Priors
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.records.rig import strains
from muscle_bayes.inference.running.precision import double_precision

DATA = Path(__file__).parents[2] / "data" / "plain"


@double_precision
def test_hyst_begins_about_its_rest_and_is_never_beyond_shut() -> None:
    problem = pose(read_runs([DATA / f"staircase-{grams}g.csv" for grams in (139, 212)]))
    layout, data = problem.layout, problem.data
    draws = prior_draws(jax.random.key(0), 800, layout, data)
    assert draws["J"].shape == (800,)
    assert draws["slow.hyst_lag"].shape == (800, 2)
    first = jax.vmap(lambda one: first_hyst(one["slow.hyst_lag"], one, data.tension))(draws)
    assert float(first.min()) > 0.0
    rest = jax.vmap(lambda one: resting_hyst(data.tension, one))(draws)[:, None]
    begun = np.asarray(rest + draws["slow.hyst_lag"])
    np.testing.assert_allclose(first, np.maximum(begun, 1e-4), rtol=1e-9)
    # As wide as the muscle moves in the runs.
    strokes = [np.ptp(strains(run)) for run in problem.runs]
    assert np.std(draws["slow.hyst_lag"]) == pytest.approx(min(max(strokes), 0.15), rel=0.05)
    vectors = jax.vmap(lambda one: unconstrain(one, layout, data))(draws)
    assert np.isfinite(jax.vmap(lambda one: log_prior(one, layout, data))(vectors)).all()


@pytest.mark.parametrize(
    "prior",
    [
        dist.Normal(0.3, 2.0),
        dist.LogNormal(-1.0, 0.7),
        dist.HalfNormal(0.2),
        dist.HalfCauchy(1.5),
        dist.Beta(2.0, 5.0),
    ],
    ids=lambda prior: type(prior).__name__,
)
@double_precision
def test_numpy_draws_each_distribution(prior: dist.Distribution) -> None:
    """Against NumPyro's cumulative distribution."""
    parameters = {name: getattr(prior, name) for name in type(prior).arg_constraints}
    drawn = SAMPLERS[type(prior)](np.random.default_rng(5), (4_000,), **parameters)
    assert kstest(np.asarray(prior.cdf(jnp.asarray(drawn))), "uniform").pvalue > 0.01


@double_precision
def test_draws_depend_on_the_key_and_have_the_quantities_shapes() -> None:
    problem = pose(read_runs([DATA / f"staircase-{grams}g.csv" for grams in (139, 212)]))
    layout, data = problem.layout, problem.data
    first, again, other = (
        sample_prior(jax.random.key(seed), 30, layout, data) for seed in (1, 1, 2)
    )
    for name, shape in layout.shapes:
        assert first[name].shape == (30, *shape)
        np.testing.assert_array_equal(first[name], again[name])
        assert np.all(first[name] != other[name])
        # No two quantities share their random numbers.
        assert np.unique(first[name]).size == first[name].size
    columns = np.stack([first[name].reshape(30, -1)[:, 0] for name, _ in layout.shapes], axis=1)
    correlation = np.corrcoef(np.argsort(np.argsort(columns, axis=0), axis=0).T)
    assert np.abs(correlation - np.eye(columns.shape[1])).max() < 0.95


@double_precision
def test_a_distribution_that_is_not_listed_is_drawn_by_numpyro() -> None:
    problem = pose(read_runs([DATA / "spring-1.csv"]))
    gamma = dist.Gamma(3.0, 2.0)
    data = problem.data._replace(priors=Priors({**problem.data.priors, "D": gamma}))
    drawn = sample_prior(jax.random.key(3), 2_000, problem.layout, data)["D"]
    assert kstest(np.asarray(gamma.cdf(jnp.asarray(drawn))), "uniform").pvalue > 0.01
