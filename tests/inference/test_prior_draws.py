"""No prior draw has HYST shorter than shut, and the density says the same."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from numpyro import distributions as dist
import pytest
from scipy.stats import kstest

from muscle_bayes.conventions import STRAIN_EPSILON
from muscle_bayes.data import read_runs
from muscle_bayes.inference.density import is_possible, log_prior, unconstrain
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.prior import first_hyst
from muscle_bayes.inference.prior_draws import SAMPLERS, prior_draws, sample_prior
from muscle_bayes.inference.priors import Priors
from muscle_bayes.inference.problem import pose

DATA = Path(__file__).parents[2] / "data"


@double_precision
def test_hyst_never_begins_shorter_than_shut():
    problem = pose(read_runs([DATA / f"staircase-{grams}g.csv" for grams in (139, 212)]))
    layout, data = problem.layout, problem.data
    draws = prior_draws(jax.random.key(0), 800, layout, data)
    assert draws["J"].shape == (800,)
    assert draws["slow.hyst_stretch"].shape == (800, 2)
    first = jax.vmap(lambda one: first_hyst(one["slow.hyst_stretch"], data.tension, one))(draws)
    assert float(first.min()) >= STRAIN_EPSILON
    # The bound is at work: stretches below 0 are rarer than above.
    assert np.mean(draws["slow.hyst_stretch"] < 0.0) < 0.48
    one = {name: value[0] for name, value in draws.items()}
    assert jnp.isfinite(log_prior(unconstrain(one, layout, data), layout, data))
    one["slow.hyst_stretch"] = (
        one["slow.hyst_stretch"].at[1].add(STRAIN_EPSILON - first[0, 1] - 1e-6)
    )
    assert not is_possible(one, data)
    assert log_prior(unconstrain(one, layout, data), layout, data) == -jnp.inf


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
