"""The filter against the dense Gaussian density that it factorises."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import multivariate_normal

from muscle_bayes.data import read_run
from muscle_bayes.inference.model.noise import (
    AT_REST,
    REACH,
    NoiseParameters,
    added_variance,
    elapsed_time,
    jolts_of,
    reading_variance,
    time_in_motion,
    whiten,
)
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.posteriors.predict import disturbances

TIME = np.array([0.0, 0.03, 0.07, 0.5, 0.5, 2.0])
SEEN = np.array([1.0, 1.0, 0.0, 1.0, 0.0, 1.0])
NOISE = NoiseParameters(0.4, 1.3, 0.6)
ELAPSED = np.diff(TIME, prepend=0.0)
CALM = np.zeros(6)
VARIANCE = np.array([0.2, 0.3, 0.1, 0.2, 0.5, 0.4])


@pytest.fixture
def sawtooth_lanes():
    """One lane of plain readings a second apart, the load jumping at 30 s."""
    run = read_run(Path(__file__).parents[2] / "data" / "plain" / "sawtooth.csv")
    with jax.enable_x64(True):
        lanes = pose([run]).data.lanes[0]
    time = np.arange(90.0)
    plain = {name: np.ones((1, 90)) for name in ("weight", "reading")}
    jolted = np.where(time == 30.0, 4.0, 0.0)[None]
    thermal = np.where(time > 50.0, 0.1, 0.02)[None]
    lanes = lanes._replace(
        swing=np.zeros((1, 90)),
        time=time[None],
        coarse=np.zeros((1, 90)),
        thermal=thermal,
        jolted=jolted,
        **plain,
    )
    return lanes, time


def dense_covariance() -> np.ndarray:
    gaps = np.abs(TIME[:, None] - TIME[None, :])
    whole = NOISE.discrepancy**2 * np.exp(-gaps / NOISE.correlation_time) + np.diag(VARIANCE)
    chosen = SEEN > 0
    return whole[np.ix_(chosen, chosen)]


def test_log_density_is_that_of_the_dense_gaussian() -> None:
    residual = np.array([0.3, -1.0, 99.0, 2.0, 99.0, 0.1])
    result = whiten(jnp.asarray(residual)[:, None], ELAPSED, VARIANCE, CALM, SEEN, NOISE)
    ours = -0.5 * (result.errors**2).sum() - result.log_scale.sum()
    ours -= 0.5 * SEEN.sum() * np.log(2 * np.pi)
    dense = multivariate_normal(cov=dense_covariance()).logpdf(residual[SEEN > 0])
    np.testing.assert_allclose(ours, dense, rtol=1e-12)


def test_columns_are_whitened_by_the_same_map() -> None:
    columns = np.random.default_rng(1).normal(size=(6, 3))
    errors = np.asarray(whiten(jnp.asarray(columns), ELAPSED, VARIANCE, CALM, SEEN, NOISE).errors)
    chosen = SEEN > 0
    precision = np.linalg.inv(dense_covariance())
    expected = columns[chosen].T @ precision @ columns[chosen]
    np.testing.assert_allclose(errors.T @ errors, expected, rtol=1e-10)


def test_unobserved_intervals_say_nothing() -> None:
    errors = whiten(jnp.full((6, 1), 7.0), ELAPSED, VARIANCE, CALM, SEEN, NOISE)
    assert np.all(np.asarray(errors.errors)[SEEN == 0] == 0.0)
    assert np.all(np.asarray(errors.log_scale)[SEEN == 0] == 0.0)


def test_variance_of_a_mean_counts_quantisation_once_for_frozen_readings() -> None:
    variance = reading_variance(NOISE, jnp.array([4.0]), jnp.array([1 / 12]), 2.0)
    np.testing.assert_allclose(variance, 0.4**2 / 4 + 4.0 / 12)


def test_the_clock_of_a_model_that_moves_far_is_time() -> None:
    elapsed = elapsed_time(1e4 * TIME, TIME, CALM, CALM, NOISE, "slow")
    np.testing.assert_allclose(elapsed, ELAPSED, rtol=1e-6)


def test_the_clock_of_a_model_at_rest_almost_stands_still() -> None:
    elapsed = elapsed_time(np.full(TIME.size, 3.0), TIME, CALM, CALM, NOISE, "slow")
    np.testing.assert_allclose(elapsed, AT_REST * ELAPSED, rtol=1e-12)


def test_the_clock_runs_at_half_speed_where_a_correlation_time_moves_by_the_discrepancy() -> None:
    speed = NOISE.discrepancy / NOISE.correlation_time
    elapsed = elapsed_time(speed * TIME, TIME, CALM, CALM, NOISE, "slow")
    np.testing.assert_allclose(elapsed, (1 + AT_REST) / 2 * ELAPSED, rtol=1e-12)


def test_only_slow_runs_wait_for_motion() -> None:
    resting = np.full(TIME.size, 3.0)
    fast = elapsed_time(resting, TIME, CALM, CALM, NOISE, "fast")
    np.testing.assert_allclose(fast, ELAPSED, rtol=1e-12)
    slow = elapsed_time(resting, TIME, CALM, CALM, NOISE, "slow")
    np.testing.assert_allclose(slow, AT_REST * ELAPSED, rtol=1e-12)


def test_the_clock_is_smooth_where_the_model_rests() -> None:
    jolted = jnp.array([0.0, 4.0, 0.0, 0.0, 0.0, 0.0])
    slope = jax.jacfwd(lambda x: elapsed_time(x, TIME, jolted, CALM, NOISE, "slow"))
    assert np.all(np.asarray(slope(jnp.full(TIME.size, 3.0))) == 0.0)


def test_motion_undoes_a_jolt_within_its_reach_but_neither_rest_nor_the_jump_itself_do() -> None:
    jolt = 8.0
    jolted = np.array([0.0, jolt, 0.0, 0.0, 0.0, 0.0])
    # A mean of readings during the jump, one after it, and the jump is over.
    jumped = np.array([0.0, 20.0, 40.0, 40.0, 40.0, 40.0])
    rested = jolts_of(jumped, jolted)
    np.testing.assert_allclose(rested.way, 0.0, atol=1e-12)
    np.testing.assert_allclose(rested.left, jolt * np.array([0, 0, 1, 1, 1, 1]), rtol=1e-12)
    moved = jumped + REACH * np.sqrt(jolt) * np.array([0.0, 0.0, 0.0, 0.5, 1.0, 3.0])
    undone = jolts_of(moved, jolted)
    np.testing.assert_allclose(undone.way, [0, 0, 0, 0.5, 0.5, 2.0], rtol=0.03)
    np.testing.assert_allclose(
        undone.left, jolt * np.array([0, 0, 1, 1, np.exp(-1), np.exp(-2)]), rtol=0.05
    )


def test_where_nothing_was_jolted_motion_undoes_nothing() -> None:
    assert np.all(np.asarray(jolts_of(50.0 * TIME, CALM).left) == 0.0)


def test_a_jolt_keeps_the_clock_at_rest_until_motion_has_undone_it() -> None:
    """Beside a discrepancy far smaller than the jolt, which a model that creeps would soon renew."""
    small = NoiseParameters(0.4, 0.01, 5.0)
    time = np.arange(6.0)
    jolted = np.array([0.0, 4.0, 0.0, 0.0, 0.0, 0.0])
    creeping = 0.02 * time
    jolts = jolts_of(creeping, jolted)
    slowly = np.asarray(time_in_motion(creeping, time, jolts, CALM, small))
    freely = np.asarray(time_in_motion(creeping, time, jolts_of(creeping, CALM), CALM, small))
    assert np.all(slowly[2:] < 0.06)
    assert np.all(freely[2:] > 0.9)
    driven = 2.0 * REACH * np.array([0.0, 0.0, 0.0, 1.0, 2.0, 2.0])
    passed = time_in_motion(driven, time, jolts_of(driven, jolted), CALM, small)
    # By way of two reaches the clock has gone on by two correlation times, and a little by itself.
    assert float(passed[3] + passed[4]) == pytest.approx(10.0, rel=0.25)


def test_readings_of_a_rotor_at_rest_tell_one_position_however_many_they_are() -> None:
    """A stop's error is one draw: a thousand readings of it count as one with the discrepancy's size."""
    time = np.arange(1000.0)
    model = np.where(time < 500, 2.0 * time, 1000.0)
    resting = time >= 500
    parameters = NoiseParameters(0.01, 0.3, 0.5)
    shift = np.where(resting, 0.3, 0.0)[:, None]
    variance, calm = np.full(time.size, parameters.noise**2), np.zeros(time.size)
    elapsed = elapsed_time(model, time, calm, calm, parameters, "slow")
    lasting = whiten(jnp.asarray(shift), elapsed, variance, calm, np.ones(time.size), parameters)
    renewed = whiten(
        jnp.asarray(shift),
        np.diff(time, prepend=0.0),
        variance,
        calm,
        np.ones(time.size),
        parameters,
    )
    assert float((lasting.errors**2).sum()) < 15.0
    assert float((renewed.errors**2).sum()) > 100.0


def test_a_jolt_leaves_the_position_open_until_the_model_has_moved_on() -> None:
    """Against the dense covariance, to which the jolt adds a step that motion forgets."""
    elapsed = np.array([0.0, 0.3, 0.1, 0.0, 0.2, 9.0])
    jolted = np.array([0.0, 0.0, 4.0, 0.0, 0.0, 0.0])
    fade = np.exp(-elapsed / NOISE.correlation_time)
    whole, spread = np.zeros((6, 6)), np.zeros(6)
    for i in range(6):
        before = spread[i - 1] if i else NOISE.discrepancy**2
        kept = fade[i] ** 2 * before
        spread[i] = kept + (1.0 - fade[i] ** 2) * NOISE.discrepancy**2 + jolted[i]
        whole[i, i] = spread[i]
        for j in range(i):
            whole[i, j] = whole[j, i] = spread[j] * np.prod(fade[j + 1 : i + 1])
    assert spread[3] == spread[2] > 4.0
    assert spread[5] == pytest.approx(NOISE.discrepancy**2, rel=1e-6)
    residual = np.array([0.3, -1.0, 2.5, 2.0, 1.7, 0.1])
    ones = np.ones(6)
    result = whiten(jnp.asarray(residual)[:, None], elapsed, VARIANCE, jolted, ones, NOISE)
    ours = -0.5 * (result.errors**2).sum() - result.log_scale.sum() - 3.0 * np.log(2 * np.pi)
    dense = multivariate_normal(cov=whole + np.diag(VARIANCE)).logpdf(residual)
    np.testing.assert_allclose(ours, dense, rtol=1e-12)


def test_drawn_disturbances_have_the_covariance_that_is_filtered(sawtooth_lanes) -> None:
    """Of a rotor that moves, is jolted, rests and moves on, under a thermometer that errs: draws against
    the filter's variance."""
    lanes, time = sawtooth_lanes
    model = np.where(time < 30.0, 3.0 * time, np.where(time < 60.0, 90.0, 3.0 * time - 90.0))
    values = {f"slow.{key}": jnp.asarray(value) for key, value in NOISE._asdict().items()}
    keys = jax.random.split(jax.random.key(0), 4000)
    draw = jax.vmap(lambda key: disturbances(key, values, model[None], lanes, "slow")[0])
    drawn = np.asarray(draw(keys))
    jolted, thermal = np.asarray(lanes.jolted[0]), np.asarray(lanes.thermal[0])
    elapsed = np.asarray(elapsed_time(model, time, jolted, thermal, NOISE, "slow"))
    spread, wanted = NOISE.discrepancy**2 + thermal[0], []
    for passed, jolt, error in zip(elapsed, jolted, thermal, strict=True):
        kept = np.exp(-2.0 * passed / NOISE.correlation_time)
        spread = kept * spread + (1.0 - kept) * (NOISE.discrepancy**2 + error) + jolt
        wanted.append(spread + NOISE.noise**2)
    np.testing.assert_allclose(drawn.var(axis=0), wanted, rtol=0.1)
    # The filter standardises what was drawn.
    white = jax.vmap(
        lambda one: whiten(
            one[:, None],
            elapsed,
            np.full(time.size, NOISE.noise**2),
            np.asarray(added_variance(elapsed, jolted, thermal, NOISE)),
            np.ones(time.size),
            NOISE,
        ).errors[:, 0]
    )
    errors = np.asarray(white(jnp.asarray(drawn)))
    np.testing.assert_allclose(errors.var(axis=0), 1.0, rtol=0.1)
    assert abs(np.corrcoef(errors[:, 10], errors[:, 11])[0, 1]) < 0.06
