"""No prior draw has HYST shorter than shut, and the density says the same."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from muscle_bayes.conventions import STRAIN_EPSILON
from muscle_bayes.data import read_runs
from muscle_bayes.inference.density import is_possible, log_prior, unconstrain
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.prior import first_hyst
from muscle_bayes.inference.prior_draws import prior_draws
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
