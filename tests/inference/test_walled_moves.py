"""Moves of the minimum forces leave a density as it is, and cross a wall that plain moves do not."""

import jax
import jax.numpy as jnp
import numpy as np
from numpyro import distributions as dist

from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.walled_moves import (
    BINS,
    Table,
    WalledProposal,
    WalledState,
    move_walled,
    offer_walled,
    tabulate,
)
from muscle_bayes.physics.springs import tensile_strain

NAMES = (
    "D",
    "modulus",
    "taut_strain",
    "F_modulus_min",
    "stiffness_hyst",
    "F_hyst_min",
    "slow.noise",
)
LAYOUT = Layout("coulomb", (), ("slow",), (False,), tuple((name, ()) for name in NAMES))
TENSION = jnp.asarray(2.0)
TABLE = Table(jnp.full(2, -4.0), jnp.full(2, 8.0 / BINS), jnp.zeros((2, BINS)))
"""Flat from -4 to 4."""
VECTOR = np.array([-0.4, 0.2, 0.0, 0.1, 0.3, -0.2, 0.0])
"""Logarithms, but for taut_strain."""


def run_chain(energy_of, iterations: int, stride: float):
    """Vectors after each round of moves, started at VECTOR."""
    proposal = WalledProposal(jnp.full(2, stride), TABLE)

    def offer_at(key, which, vector):
        return offer_walled(key, which, vector, proposal, TENSION, LAYOUT)

    def step(state, key):
        state = move_walled(key, state, energy_of, offer_at, LAYOUT)
        return state, state.vector

    start = WalledState(jnp.asarray(VECTOR), energy_of(jnp.asarray(VECTOR)))
    keys = jax.random.split(jax.random.key(0), iterations)
    return np.asarray(jax.jit(lambda s: jax.lax.scan(step, s, keys))(start)[1])


@double_precision
def test_a_normal_density_is_left_as_it_is():
    spread = np.array(
        [
            [0.20, 0.05, 0.10, -0.03],
            [0.05, 0.30, 0.10, -0.05],
            [0.10, 0.10, 0.20, 0.04],
            [-0.03, -0.05, 0.04, 0.25],
        ]
    )
    moved = np.array([0, 2, 3, 5])
    precision = jnp.linalg.inv(jnp.asarray(spread))

    def energy(vector):
        away = vector[moved] - VECTOR[moved]
        return 0.5 * away @ precision @ away

    draws = run_chain(energy, 80_000, 0.8)
    still = np.array([1, 4, 6])
    np.testing.assert_allclose(draws[:, still] - VECTOR[still], 0.0, atol=1e-12)
    seen = draws[1000:][:, np.asarray(moved)]
    np.testing.assert_allclose(seen.mean(axis=0), VECTOR[moved], atol=0.04)
    np.testing.assert_allclose(np.cov(seen.T), spread, atol=0.03)


@double_precision
def test_a_slack_spring_s_force_moves_with_the_muscle_s_length_held():
    """Only C is known, to 1e-4: what a slack MODULUS tells."""

    def resting(vector):
        return vector[2] - tensile_strain(TENSION, jnp.exp(vector[1]), jnp.exp(vector[3]))

    def energy(vector):
        length, known = resting(vector), resting(jnp.asarray(VECTOR))
        prior = (vector[3] - VECTOR[3]) ** 2 + (vector[5] - VECTOR[5]) ** 2
        return 0.5 * ((length - known) / 1e-4) ** 2 + 0.5 * prior

    forces = run_chain(energy, 40_000, 1.0)[500:, 3]
    np.testing.assert_allclose(forces.std(), 1.0, rtol=0.15)


@double_precision
def test_friction_keeps_its_share_of_a_shut_spring_s_force():
    """Only log D - log F_modulus_min is known, to 1e-4: what a shut MODULUS tells."""

    def share(vector):
        return vector[0] - vector[3]

    def energy(vector):
        known = share(jnp.asarray(VECTOR))
        prior = (vector[3] - VECTOR[3]) ** 2 + (vector[5] - VECTOR[5]) ** 2
        return 0.5 * ((share(vector) - known) / 1e-4) ** 2 + 0.5 * prior

    forces = run_chain(energy, 40_000, 1.0)[500:, 3]
    np.testing.assert_allclose(forces.std(), 1.0, rtol=0.15)


@double_precision
def test_a_table_is_the_conditional_density():
    priors = {name: dist.LogNormal(0.0, 1.0) for name in NAMES}
    data = Data((), priors, jnp.ones(()), TENSION, jnp.ones(()))
    wall = 0.5

    def energy(vector):
        beyond = (vector[3] > wall) | (vector[5] > 2.0 * wall)
        return jnp.where(beyond, 1e6, 0.5 * (vector[3] ** 2 + vector[5] ** 2))

    table = tabulate(lambda v: float(energy(v)), jnp.asarray(VECTOR), LAYOUT, data)
    keys = jax.random.split(jax.random.key(1), 20_000)
    for which, end in ((0, wall), (1, 2.0 * wall)):
        draws = np.asarray(jax.vmap(lambda key, w=which: table.draw(key, w))(keys))
        bin_width = float(table.width[which])
        assert abs(np.mean(draws < end + bin_width) - 0.97) < 0.02
        normal = np.random.default_rng(0).standard_normal(200_000)
        kept = draws[draws < end]
        np.testing.assert_allclose(kept.mean(), normal[normal < end].mean(), atol=0.06)
    outside = table.log_density(0, table.low[0] - 1.0)
    assert outside == -jnp.inf
