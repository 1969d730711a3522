"""The distribution of readings about a model, against the dense normal distribution that it stands for."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro import distributions as dist
from scipy.stats import multivariate_normal

from muscle_bayes.inference.model.discrepancy import OUDiscrepancy
from muscle_bayes.inference.model.noise import NoiseParameters

NOISE = NoiseParameters(noise=0.4, discrepancy=1.3, correlation_time=0.6)
PREDICTION = np.array([0.2, 0.5, -0.3, 1.0, 0.0, 0.7])
ELAPSED = np.array([0.3, 0.03, 0.2, 1.0, 0.0, 0.4])
WHITE = np.array([0.2, 0.3, 0.1, 0.2, 0.5, 0.4])
SEEN = np.array([1.0, 1.0, 0.0, 1.0, 0.0, 1.0])
LOAD_STEP = np.array([0.0, 0.0, 0.0, 2.5, 0.0, 0.0])
BASIS = np.array([[1.0, 0.0], [1.0, 0.1], [0.9, 0.4], [0.8, 0.9], [0.5, 1.4], [0.2, 2.0]])
READING = np.array([0.5, -0.4, 99.0, 2.3, 99.0, 0.1])

CASES = {"plain": {}, "load step": {"added": LOAD_STEP}, "basis": {"basis": BASIS}}
CASES["both"] = {"added": LOAD_STEP, "basis": BASIS}


def covariance(added=None, basis=None, elapsed=ELAPSED) -> np.ndarray:
    """As the class tells it; what a jump adds fades as the discrepancy does."""
    clock = np.cumsum(elapsed)
    fading = np.exp(-np.abs(clock[:, None] - clock) / NOISE.correlation_time)
    whole = NOISE.discrepancy**2 * fading + np.diag(WHITE)
    for at, variance in enumerate(np.zeros(6) if added is None else added):
        later = np.where(np.arange(6) >= at, fading[at], 0.0)
        whole += variance * np.outer(later, later)
    return whole if basis is None else whole + basis @ basis.T


def distribution(observed=SEEN, **parts) -> OUDiscrepancy:
    return OUDiscrepancy(*map(jnp.asarray, (PREDICTION, ELAPSED, WHITE, observed)), NOISE, **parts)


@pytest.mark.parametrize("parts", CASES.values(), ids=CASES)
def test_the_density_is_that_of_the_dense_normal(parts) -> None:
    seen = SEEN > 0
    dense = multivariate_normal(PREDICTION[seen], covariance(**parts)[np.ix_(seen, seen)])
    found = distribution(**parts).log_prob(jnp.asarray(READING))
    np.testing.assert_allclose(found, dense.logpdf(READING[seen]), rtol=1e-11)


@pytest.mark.parametrize("parts", CASES.values(), ids=CASES)
def test_sensitivities_are_what_errors_change_by(parts) -> None:
    """Errors are linear in the prediction: two differ by the sensitivity to their difference."""
    changes = np.random.default_rng(0).normal(size=(6, 3))
    one = distribution(**parts)
    found = one.sensitivities(jnp.asarray(changes))
    before = one.innovations(jnp.asarray(READING)).errors
    for column in range(3):
        # A prediction that is higher makes readings lower beside it.
        after = one.innovations(jnp.asarray(READING - changes[:, column])).errors
        np.testing.assert_allclose(found[:, column], after - before, atol=1e-11)


def test_densities_of_single_readings_add_up_and_what_is_not_observed_says_nothing() -> None:
    one = distribution(**CASES["both"])
    each = np.asarray(one.log_densities(jnp.asarray(READING)))
    np.testing.assert_allclose(each.sum(), one.log_prob(jnp.asarray(READING)), rtol=1e-12)
    np.testing.assert_array_equal(each[SEEN == 0], 0.0)


def test_standardised_errors_are_white() -> None:
    """Of draws of the distribution itself, without a basis."""
    whole = distribution(np.ones(6), **CASES["load step"])
    draws = whole.sample(jax.random.key(2), (20_000,))
    errors = jax.vmap(lambda reading: whole.innovations(reading).errors)(draws)
    np.testing.assert_allclose(np.cov(errors.T), np.eye(6), atol=0.04)


@pytest.mark.parametrize("parts", CASES.values(), ids=CASES)
def test_draws_have_its_mean_and_covariance(parts) -> None:
    draws = np.asarray(distribution(np.ones(6), **parts).sample(jax.random.key(0), (40_000,)))
    assert draws.shape == (40_000, 6)
    wanted = covariance(**parts)
    spread = np.sqrt(np.diag(wanted))
    away = (draws.mean(0) - PREDICTION) / spread
    assert np.abs(away).max() < 4.0 / np.sqrt(len(draws))
    error = (np.cov(draws.T) - wanted) / np.outer(spread, spread)
    assert np.abs(error).max() < 4.0 * np.sqrt(2.0 / len(draws))


def test_a_batch_is_each_record_by_itself() -> None:
    rng = np.random.default_rng(1)
    shift = rng.normal(size=(3, 6))
    arrays = [np.stack([one] * 3) for one in (ELAPSED, WHITE, SEEN)]
    more = {name: jnp.stack([part] * 3) for name, part in CASES["both"].items()}
    batch = OUDiscrepancy(jnp.asarray(PREDICTION + shift), *map(jnp.asarray, arrays), NOISE, **more)
    assert (batch.batch_shape, batch.event_shape) == ((3,), (6,))
    alone = distribution(**CASES["both"])
    expected = [float(alone.log_prob(jnp.asarray(READING - one))) for one in shift]
    np.testing.assert_allclose(batch.log_prob(jnp.asarray(READING)), expected, rtol=1e-10)
    np.testing.assert_allclose(batch.of(1).log_prob(jnp.asarray(READING)), expected[1], rtol=1e-10)
    some = batch.of(np.array([2, 0])).log_prob(jnp.asarray(READING))
    np.testing.assert_allclose(some, [expected[2], expected[0]], rtol=1e-10)
    assert batch.sample(jax.random.key(0), (4,)).shape == (4, 3, 6)


@pytest.mark.parametrize("records", [None, 2], ids=["one record", "a batch"])
def test_many_readings_at_once_have_the_density_of_each(records: int | None) -> None:
    """What it draws it can judge, as NumPyro asks of a distribution."""
    one: dist.Distribution = distribution()
    if records:
        shared = [jnp.stack([jnp.asarray(x)] * records) for x in (PREDICTION, ELAPSED, WHITE, SEEN)]
        one = OUDiscrepancy(*shared, NOISE)
    draws = one.sample(jax.random.key(5), (2, 3))
    found = one.log_prob(draws)
    assert found.shape == (2, 3, *one.batch_shape)
    np.testing.assert_allclose(found[1, 2], one.log_prob(draws[1, 2]), rtol=1e-12)
