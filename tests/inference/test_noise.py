"""The filter against the dense Gaussian density that it factorises."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy.stats import multivariate_normal

from muscle_bayes.inference.noise import (
    AT_REST,
    NoiseParameters,
    reading_variance,
    time_in_motion,
    whiten,
)

TIME = np.array([0.0, 0.03, 0.07, 0.5, 0.5, 2.0])
SEEN = np.array([1.0, 1.0, 0.0, 1.0, 0.0, 1.0])
NOISE = NoiseParameters(0.4, 1.3, 0.6)
ELAPSED = np.diff(TIME, prepend=0.0)
VARIANCE = np.array([0.2, 0.3, 0.1, 0.2, 0.5, 0.4])


def dense_covariance() -> np.ndarray:
    gaps = np.abs(TIME[:, None] - TIME[None, :])
    whole = NOISE.discrepancy**2 * np.exp(-gaps / NOISE.correlation_time) + np.diag(VARIANCE)
    chosen = SEEN > 0
    return whole[np.ix_(chosen, chosen)]


def test_log_density_is_that_of_the_dense_gaussian() -> None:
    residual = np.array([0.3, -1.0, 99.0, 2.0, 99.0, 0.1])
    result = whiten(jnp.asarray(residual)[:, None], ELAPSED, VARIANCE, SEEN, NOISE)
    ours = -0.5 * (result.errors**2).sum() - result.log_scale.sum()
    ours -= 0.5 * SEEN.sum() * np.log(2 * np.pi)
    dense = multivariate_normal(cov=dense_covariance()).logpdf(residual[SEEN > 0])
    np.testing.assert_allclose(ours, dense, rtol=1e-12)


def test_columns_are_whitened_by_the_same_map() -> None:
    columns = np.random.default_rng(1).normal(size=(6, 3))
    errors = np.asarray(whiten(jnp.asarray(columns), ELAPSED, VARIANCE, SEEN, NOISE).errors)
    chosen = SEEN > 0
    precision = np.linalg.inv(dense_covariance())
    expected = columns[chosen].T @ precision @ columns[chosen]
    np.testing.assert_allclose(errors.T @ errors, expected, rtol=1e-10)


def test_unobserved_intervals_say_nothing() -> None:
    errors = whiten(jnp.full((6, 1), 7.0), ELAPSED, VARIANCE, SEEN, NOISE)
    assert np.all(np.asarray(errors.errors)[SEEN == 0] == 0.0)
    assert np.all(np.asarray(errors.log_scale)[SEEN == 0] == 0.0)


def test_variance_of_a_mean_counts_quantisation_once_for_frozen_readings() -> None:
    variance = reading_variance(NOISE, jnp.array([4.0]), jnp.array([1 / 12]), 2.0)
    np.testing.assert_allclose(variance, 0.4**2 / 4 + 4.0 / 12)


def test_the_clock_of_a_model_that_moves_far_is_time() -> None:
    elapsed = time_in_motion(1e4 * TIME, TIME, NOISE)
    np.testing.assert_allclose(elapsed, ELAPSED, rtol=1e-6)


def test_the_clock_of_a_model_at_rest_almost_stands_still() -> None:
    elapsed = time_in_motion(np.full(TIME.size, 3.0), TIME, NOISE)
    np.testing.assert_allclose(elapsed, AT_REST * ELAPSED, rtol=1e-12)


def test_the_clock_runs_at_half_speed_where_a_correlation_time_moves_by_the_discrepancy() -> None:
    speed = NOISE.discrepancy / NOISE.correlation_time
    elapsed = time_in_motion(speed * TIME, TIME, NOISE)
    np.testing.assert_allclose(elapsed, (1 + AT_REST) / 2 * ELAPSED, rtol=1e-12)


def test_the_clock_is_smooth_where_the_model_rests() -> None:
    slope = jax.jacfwd(lambda x: time_in_motion(x, TIME, NOISE))(jnp.full(TIME.size, 3.0))
    assert np.all(np.asarray(slope) == 0.0)


def test_readings_of_a_rotor_at_rest_tell_one_position_however_many_they_are() -> None:
    """A stop's error is one draw: a thousand readings of it count as one with the discrepancy's size."""
    time = np.arange(1000.0)
    model = np.where(time < 500, 2.0 * time, 1000.0)
    resting = time >= 500
    parameters = NoiseParameters(0.01, 0.3, 0.5)
    shift = np.where(resting, 0.3, 0.0)[:, None]
    variance = np.full(time.size, parameters.noise**2)
    elapsed = time_in_motion(model, time, parameters)
    lasting = whiten(jnp.asarray(shift), elapsed, variance, np.ones(time.size), parameters)
    renewed = whiten(
        jnp.asarray(shift),
        np.diff(time, prepend=0.0),
        variance,
        np.ones(time.size),
        parameters,
    )
    assert float((lasting.errors**2).sum()) < 15.0
    assert float((renewed.errors**2).sum()) > 100.0
