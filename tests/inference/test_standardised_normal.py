"""A normal prior that is told in units of its own standard deviation."""

import pickle
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import numpyro
import pytest
from numpyro import distributions as dist
from numpyro.distributions import biject_to
from numpyro.infer import MCMC, NUTS
from scipy.stats import norm

from muscle_bayes.data import read_runs
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.model.standardised_normal import StandardisedNormal, standardised
from muscle_bayes.physics.effects import CATALOGUE

PRIOR = standardised(dist.Normal(300.0, 2000.0))
UNIT = 1000.0


def test_the_density_is_the_normal_one_in_both_coordinates() -> None:
    values = jnp.array([-5000.0, 0.0, 300.0, 1500.0])
    assert PRIOR.log_prob(values) == pytest.approx(norm(300.0, 2000.0).logpdf(values), rel=1e-5)
    free = biject_to(PRIOR.support)
    assert free.inv(values) == pytest.approx(np.asarray(values) / UNIT)
    assert free(free.inv(values)) == pytest.approx(np.asarray(values))
    # Density of value / 1000: that of the value times 1000.
    told = PRIOR.log_prob(values) + free.log_abs_det_jacobian(free.inv(values), values)
    assert told == pytest.approx(norm(0.3, 2.0).logpdf(np.asarray(values) / UNIT), rel=1e-5)


def test_it_has_its_place_in_compiled_code_and_in_numpyro() -> None:
    value = jax.jit(lambda prior: biject_to(prior.support)(jnp.array(0.5)))(PRIOR)
    assert value == pytest.approx(500.0)

    def model() -> None:
        numpyro.sample("x", PRIOR)

    chains = MCMC(NUTS(model), num_warmup=300, num_samples=2000, progress_bar=False)
    chains.run(jax.random.key(0))
    draws = np.asarray(chains.get_samples()["x"])
    assert draws.mean() == pytest.approx(300.0, abs=300.0)
    assert draws.std() == pytest.approx(2000.0, rel=0.15)


def test_it_can_be_sent_to_another_process() -> None:
    assert type(pickle.loads(pickle.dumps(PRIOR))) is type(PRIOR)


def test_every_effect_with_a_normal_prior_has_it() -> None:
    data = Path(__file__).parents[2] / "data" / "plain"
    problem = pose(read_runs([data / "staircase-166g.csv"]), "coulomb", tuple(CATALOGUE))
    told = {}
    for name in CATALOGUE:
        for key in CATALOGUE[name].parameters:
            prior = problem.data.priors[f"{name}.{key}"]
            assert type(prior) is not dist.Normal
            if isinstance(prior, StandardisedNormal):
                told[f"{name}.{key}"] = float(
                    biject_to(prior.support)(jnp.array(1.0)) / prior.scale
                )
    assert {"damper-law.activation_temperature", "bias-torque.torque"} <= set(told)
    assert all(10**-0.51 < value < 10**0.51 for value in told.values())
    slack = dist.HalfNormal(0.05)
    assert standardised(slack) is slack
