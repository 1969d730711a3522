"""Moves along a surrogate draw from the target, whatever the surrogate."""

import jax
import jax.numpy as jnp
import numpy as np

from muscle_bayes.inference.chained_moves import chained
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.proposed_move import ProposedMove


@double_precision
def test_the_end_is_judged_by_the_target_alone():
    """Target N(0.3, 1); surrogate N(-0.4, 1.5^2)."""

    def offer(key, vector):
        return ProposedMove(vector + 1.5 * jax.random.normal(key, vector.shape), jnp.zeros(()))

    def surrogate(vector):
        return 0.5 * ((vector[0] + 0.4) / 1.5) ** 2

    def target(vector):
        return 0.5 * (vector[0] - 0.3) ** 2

    def move(vector, key):
        key_chain, key_accept = jax.random.split(key)
        made = chained(key_chain, vector, surrogate, offer, 5)
        rise = target(made.vector) - target(vector) - made.log_odds
        taken = jnp.log(jax.random.uniform(key_accept)) < -rise
        vector = jnp.where(taken, made.vector, vector)
        return vector, vector[0]

    keys = jax.random.split(jax.random.key(0), 60_000)
    drawn = np.asarray(jax.lax.scan(move, jnp.zeros(1), keys)[1])
    np.testing.assert_allclose(drawn.mean(), 0.3, atol=0.03)
    np.testing.assert_allclose(drawn.std(), 1.0, atol=0.03)
