"""Slice sampling, against moments that are known."""

from collections.abc import Callable

import arviz as az
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import expon, norm, truncnorm

from muscle_bayes.inference.sampling.slice_sampling import slice_sweep

CHAINS, DRAWS = 50, 400


def drawn(density: Callable, start: list[float], directions: np.ndarray, **limits) -> np.ndarray:
    """Draws of many chains, (chain, draw, entry); the first few are dropped."""

    @jax.jit
    @jax.vmap
    def chain(key: jax.Array) -> jax.Array:
        def step(point, key):
            there = slice_sweep(
                key, lambda x: (density(x), ()), point, jnp.asarray(directions), **limits
            )
            return there.point, there.point

        return jax.lax.scan(step, jnp.array(start), jax.random.split(key, DRAWS))[1]

    return np.asarray(chain(jax.random.split(jax.random.key(0), CHAINS)))[:, 20:]


def away(draws: np.ndarray, wanted: float) -> float:
    """By how many standard errors the mean of (chain, draw) is off."""
    error = draws.std() / np.sqrt(az.ess(draws, method="mean"))
    return abs(draws.mean() - wanted) / error


TRUNCATED = truncnorm(-0.5, np.inf, 0.5, 1.0)
KNOWN = {
    "a normal beyond a wall": (lambda x: -0.5 * (x - 0.5) ** 2, 0.0, TRUNCATED),
    "an exponential": (lambda x: -x / 2.0, 0.0, expon(scale=2.0)),
    "a normal": (lambda x: -0.5 * (x - 3.0) ** 2 / 4.0, -np.inf, norm(3.0, 2.0)),
}


@pytest.mark.parametrize(("log_density", "wall", "known"), KNOWN.values(), ids=KNOWN)
@pytest.mark.parametrize("width", [2.0, 6.0, 20.0])
def test_moments_are_those_of_the_density(log_density, wall, known, width) -> None:
    def density(x: jax.Array) -> jax.Array:
        return jnp.where(x[0] > wall, log_density(x[0]), -jnp.inf)

    draws = drawn(density, [1.0], np.array([[width]]))[..., 0]
    assert draws.min() > wall
    assert away(draws, known.mean()) < 4.0
    assert away((draws - known.mean()) ** 2, known.var()) < 4.0


def test_what_is_not_a_number_is_a_wall_too() -> None:
    draws = drawn(lambda x: -0.5 * (jnp.sqrt(x[0]) ** 2 - 0.5) ** 2, [1.0], np.eye(1))[..., 0]
    assert np.isfinite(draws).all()
    assert away(draws, TRUNCATED.mean()) < 4.0


def test_two_peaks_have_their_shares() -> None:
    """Normals 4 apart, of weights 1 and 3: an interval reaches over the gap between them."""

    def density(x: jax.Array) -> jax.Array:
        peaks = -0.5 * (x[0] - jnp.array([-2.0, 2.0])) ** 2 / 0.25 + jnp.log(jnp.array([1.0, 3.0]))
        return jax.nn.logsumexp(peaks)

    draws = drawn(density, [-2.0], np.array([[8.0]]))[..., 0]
    assert away((draws > 0.0).astype(float), 0.75) < 4.0
    assert away((draws[draws > 0.0] - 2.0)[None], 0.0) < 5.0


def test_directions_that_are_not_axes_keep_a_correlated_normal() -> None:
    covariance = np.array([[1.0, 0.9], [0.9, 1.0]])
    precision = jnp.asarray(np.linalg.inv(covariance))
    draws = drawn(
        lambda x: -0.5 * x @ precision @ x,
        [0.0, 0.0],
        np.array([[1.0, 1.0], [0.3, -0.3], [1.0, 0.0]]),
    )
    for (i, j), wanted in np.ndenumerate(covariance):
        assert away(draws[..., i] * draws[..., j], wanted) < 4.0
    assert away(draws[..., 0], 0.0) < 4.0


def test_the_extra_is_that_of_the_point() -> None:
    def density(x: jax.Array) -> tuple[jax.Array, dict[str, jax.Array]]:
        return -0.5 * jnp.sum(x**2), {"doubled": 2.0 * x, "whole": jnp.round(x).astype(int)}

    for seed in range(5):
        found = slice_sweep(jax.random.key(seed), density, jnp.array([0.3, -1.0]), 2.0 * jnp.eye(2))
        value, extra = density(found.point)
        assert not np.any(found.point == jnp.array([0.3, -1.0]))
        np.testing.assert_allclose(found.log_density, value, rtol=1e-12)
        jax.tree.map(np.testing.assert_array_equal, found.extra, extra)


def test_where_no_look_succeeds_a_point_stays() -> None:
    """All the density is at the point itself, or nearly."""
    start = jnp.array([0.5])
    found = slice_sweep(
        jax.random.key(0),
        lambda x: (-1e40 * (x[0] - 0.5) ** 2, ()),
        start,
        jnp.eye(1),
        most_looks=6,
    )
    np.testing.assert_array_equal(found.point, start)
