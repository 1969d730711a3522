"""The play operator finds the nearest rest of forces with kinks, walls and several equilibria."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

from muscle_bayes.physics.solvers.play import play

STOPS = (-1.5, 1.2)
COUNT = 200
SLIDING = 0.02


def kinked(x, p):
    """A soft spring, and beyond a wall one that may be a million times stiffer; both bend."""
    beyond = jnp.maximum(x - p["wall"], 0.0)
    return p["push"] - p["soft"] * (x + 0.3 * x**3) - p["stiff"] * beyond * (1.0 + beyond)


def kinked_forces(rng: np.random.Generator) -> dict[str, np.ndarray]:
    return {
        "push": rng.normal(size=COUNT) * 0.5,
        "soft": 10.0 ** rng.uniform(-2, 0, COUNT),
        "stiff": 10.0 ** rng.uniform(0, 6, COUNT),
        "wall": rng.uniform(-0.5, 0.8, COUNT),
    }


def wavy(x, p):
    """Over-centre positions on the way, as wide as half the way to them: narrower ones may be passed."""
    return p["push"] + jnp.sin(p["rate"] * x + p["phase"])


def wavy_forces(rng: np.random.Generator) -> dict[str, np.ndarray]:
    return {
        "push": rng.uniform(-0.4, 0.4, COUNT),
        "rate": rng.uniform(1.5, 3.5, COUNT),
        "phase": rng.uniform(0.0, 6.28, COUNT),
    }


def slid(force, start: float, static: float) -> float:
    """Walk in small steps to where the rest is passed, then Brent's method."""
    pull = force(start)
    if abs(pull) <= static:
        return start
    way = np.sign(pull)
    path = np.linspace(start, STOPS[1] if way > 0 else STOPS[0], 20001)
    passed = np.flatnonzero(way * force(path) <= SLIDING)
    if passed.size == 0:
        return path[-1]
    at = passed[0]
    return brentq(lambda x: way * force(x) - SLIDING, path[at - 1], path[at], xtol=1e-14)


@pytest.mark.parametrize("static", [0.02, 0.2])
@pytest.mark.parametrize(("law", "forces"), [(kinked, kinked_forces), (wavy, wavy_forces)])
def test_the_nearest_rest_is_found(law, forces, static):
    rng = np.random.default_rng(5)
    parameters = forces(rng)
    start = rng.uniform(*STOPS, COUNT)

    def rest(q, p):
        def pulls(x, both):
            return law(x, both[0]), jnp.where(x == both[1], static, SLIDING)

        return play(pulls, q, (p, q), STOPS)

    found = jax.jit(jax.vmap(rest))(jnp.asarray(start), jax.tree.map(jnp.asarray, parameters))
    wanted = []
    for index, q in enumerate(start):
        one = {name: float(column[index]) for name, column in parameters.items()}
        wanted.append(slid(lambda x, one=one: np.asarray(law(x, one)), q, static))
    np.testing.assert_allclose(found, wanted, atol=1e-9)
    moved = np.abs(np.subtract(wanted, start)) > 0.01
    rests = moved & ~np.isin(wanted, STOPS)
    assert rests.sum() > 50
    assert np.isin(wanted, STOPS).any()
    assert (~moved).any()


@pytest.mark.parametrize("broken", [jnp.nan, jnp.inf])
def test_a_force_that_is_not_finite_is_no_rest(broken):
    def everywhere(x, k):
        return k - x, SLIDING

    def far(x, k):
        return jnp.where(x < 0.3, k * x, -x - 1.0), SLIDING

    assert not jnp.isfinite(play(everywhere, jnp.asarray(0.5), broken, STOPS))
    behind = play(far, jnp.asarray(0.5), broken, STOPS)
    assert not jnp.isfinite(behind)
