"""Chains begin as far apart as the posterior is wide, also where it is curved."""

from types import SimpleNamespace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.inference.sampling import normal
from muscle_bayes.inference.sampling.normal import along_valley, dispersed
from muscle_bayes.inference.search.mode import Mode, Seen

THIN = 1e-3
"""Standard deviation across a valley that is a thousand times longer."""
BEND = 0.7


def residuals(vector: jax.Array) -> jax.Array:
    """Of a banana: x normal, y = BEND x^2 but for a little."""
    x, y = vector
    return jnp.array([x, (y - BEND * x**2) / THIN])


def potential(vector: jax.Array, *_: Any) -> jax.Array:
    return 0.5 * jnp.sum(residuals(vector) ** 2)


def seen(vector: jax.Array, *_: Any) -> Seen:
    jacobian = jax.jacfwd(residuals)(vector)
    return Seen(potential(vector), jax.grad(potential)(vector), jacobian.T @ jacobian)


@pytest.fixture
def mode(monkeypatch: pytest.MonkeyPatch) -> Mode:
    """The banana's, in place of a plant's posterior."""
    monkeypatch.setattr(normal, "potential_at", potential)
    monkeypatch.setattr(normal, "seen_at", seen)
    place = jnp.zeros(2)
    return Mode(place, 0.0, np.asarray(seen(place).information), 0)


PROBLEM: Any = SimpleNamespace(layout=None, data=None)
BOTH = np.array([0, 1])


def test_a_path_follows_the_valley(mode: Mode) -> None:
    with jax.enable_x64(True):
        path = along_valley(mode, BOTH, np.array([1.5, 9.0]), PROBLEM)
    np.testing.assert_allclose(np.abs([x for x, _ in path]), 1.5 * np.arange(1, 7) / 6, atol=1e-4)
    for x, y in path:
        assert y == pytest.approx(BEND * x**2, abs=THIN)


def test_starts_are_as_wide_as_a_curved_posterior(mode: Mode) -> None:
    random = np.random.default_rng(3)
    with jax.enable_x64(True):
        starts = np.array([dispersed(random, mode, BOTH, PROBLEM) for _ in range(80)])
        levels = [float(potential(jnp.asarray(one))) for one in starts]
    assert max(levels) < 2.0
    # Starts as unlikely as two nats are drawn in; a normal cut there has this standard deviation.
    assert 0.75 < starts[:, 0].std() < 1.05
    assert np.abs(starts[:, 0].mean()) < 0.25
