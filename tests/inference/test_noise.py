"""The filter against the dense Gaussian density that it factorises."""

import jax.numpy as jnp
import numpy as np
from scipy.stats import multivariate_normal

from muscle_bayes.inference.noise import NoiseParameters, reading_variance, whiten

TIME = np.array([0.0, 0.03, 0.07, 0.5, 0.5, 2.0])
SEEN = np.array([1.0, 1.0, 0.0, 1.0, 0.0, 1.0])
NOISE = NoiseParameters(0.4, 1.3, 0.6)
VARIANCE = np.array([0.2, 0.3, 0.1, 0.2, 0.5, 0.4])


def dense_covariance() -> np.ndarray:
    gaps = np.abs(TIME[:, None] - TIME[None, :])
    whole = NOISE.discrepancy**2 * np.exp(-gaps / NOISE.correlation_time) + np.diag(VARIANCE)
    chosen = SEEN > 0
    return whole[np.ix_(chosen, chosen)]


def test_log_density_is_that_of_the_dense_gaussian() -> None:
    residual = np.array([0.3, -1.0, 99.0, 2.0, 99.0, 0.1])
    result = whiten(jnp.asarray(residual)[:, None], TIME, VARIANCE, SEEN, NOISE)
    ours = -0.5 * (result.errors**2).sum() - result.log_scale.sum()
    ours -= 0.5 * SEEN.sum() * np.log(2 * np.pi)
    dense = multivariate_normal(cov=dense_covariance()).logpdf(residual[SEEN > 0])
    np.testing.assert_allclose(ours, dense, rtol=1e-12)


def test_columns_are_whitened_by_the_same_map() -> None:
    columns = np.random.default_rng(1).normal(size=(6, 3))
    errors = np.asarray(whiten(jnp.asarray(columns), TIME, VARIANCE, SEEN, NOISE).errors)
    chosen = SEEN > 0
    precision = np.linalg.inv(dense_covariance())
    expected = columns[chosen].T @ precision @ columns[chosen]
    np.testing.assert_allclose(errors.T @ errors, expected, rtol=1e-10)


def test_unobserved_intervals_say_nothing() -> None:
    errors = whiten(jnp.full((6, 1), 7.0), TIME, VARIANCE, SEEN, NOISE)
    assert np.all(np.asarray(errors.errors)[SEEN == 0] == 0.0)
    assert np.all(np.asarray(errors.log_scale)[SEEN == 0] == 0.0)


def test_variance_of_a_mean_counts_quantisation_once_for_frozen_readings() -> None:
    variance = reading_variance(NOISE, jnp.array([4.0]), jnp.array([1 / 12]), 2.0)
    np.testing.assert_allclose(variance, 0.4**2 / 4 + 4.0 / 12)
