"""Where in a step the speed reverses."""

import jax
import jax.numpy as jnp
import numpy as np

from muscle_bayes.physics.solvers import StickSlip
from muscle_bayes.physics.state import PlantState

COUNT = 4000


def reversals(seed: int):
    """Speeds and accelerations at both ends of steps over which the speed reverses, of any size."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-14, 1, (4, COUNT))
    sign = np.where(rng.random(COUNT) < 0.5, -1.0, 1.0)
    v0, v1 = sign * size[0], -sign * size[1]
    a0, a1 = size[2:] * rng.choice([-1.0, 0.0, 1.0], (2, COUNT))
    return map(jnp.asarray, (v0, a0, v1, a1))


def test_the_reversal_lies_inside_the_step_whatever_the_speeds():
    def share(v0, a0, v1, a1):
        def state(q, speed):
            return PlantState(q, speed, jnp.zeros(2), {})

        zero = jnp.zeros(())
        ends = state(zero, v0), state(v0, a0), state(zero, v1), state(v1, a1)
        return StickSlip()._reversal(*ends, jnp.asarray(0.1), jnp.asarray(True))[0]

    found, slopes = jax.jit(jax.vmap(jax.value_and_grad(share)))(*reversals(0))
    assert np.all((found >= 0.0) & (found <= 1.0))
    assert np.isfinite(slopes).all()


def test_the_reversal_is_where_the_cubic_is_zero():
    """Of a cubic speed, with the way to there and a cubic course of HYST."""
    speed = np.polynomial.Polynomial([1.0, -1.0]) * np.polynomial.Polynomial([1.0, -2.0])
    speed = speed * np.polynomial.Polynomial([1.0, 1.0 / 3.0]) - 0.25
    root = min(r.real for r in speed.roots() if abs(r.imag) < 1e-12 and 0.0 < r.real < 1.0)
    path, rate, duration = speed.integ(), speed.deriv(), 0.5

    def state(q, speed, x):
        return PlantState(*map(jnp.asarray, (q, speed)), jnp.full(2, x), {})

    begin, end = state(0.3, speed(0.0), 0.0), state(0.0, speed(0.7), 0.7**3)
    before = state(speed(0.0), rate(0.0) / duration, 0.0)
    after = state(speed(0.7), rate(0.7) / duration, 3.0 * 0.7**2 / duration)
    assert speed(0.0) * speed(0.7) < 0.0
    span = jnp.asarray(0.7 * duration)
    share, there = StickSlip()._reversal(begin, before, end, after, span, jnp.asarray(True))
    np.testing.assert_allclose(0.7 * share, root, rtol=1e-14)
    np.testing.assert_allclose(there.q, 0.3 + duration * path(root), rtol=1e-14)
    np.testing.assert_allclose(there.hyst, root**3, rtol=1e-12)
    assert there.speed == 0.0
