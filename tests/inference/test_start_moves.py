"""Starts drawn anew from their prior, against a posterior that is known on both sides of an edge."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
from numpyro import distributions as dist

from muscle_bayes.inference.dead_bands import START
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.problem import Layout
from muscle_bayes.inference.squeeze import Squeeze
from muscle_bayes.inference.start_moves import has_edges, offer_start

LAYOUT = Layout("coulomb", (), ("slow",), (False,), (("D", ()), (START, (3,))))
PRIOR = dist.Normal(jnp.array([5.0, 7.0, 9.0]), jnp.array([0.5, 0.4, 0.3]))
DATA = SimpleNamespace(priors={START: PRIOR})
ENTRY, RUN = 2, 1
TOLD = 0.05
"""Standard deviation of the start inside, in the prior's."""


def _squeeze() -> Squeeze:
    """With one edge, of the second run."""
    none = Squeeze.none(LAYOUT)
    slope = none.slope.at[3].set(jnp.array([0.4, 0.0, -0.8, 0.0]))
    return none._replace(slope=slope, direction=none.direction.at[3, ENTRY].set(1.0 / -0.8))


@double_precision
def test_both_sides_have_their_share():
    """Beyond its edge readings tell nothing of a start; inside they tell it to TOLD."""
    squeeze = _squeeze()
    assert has_edges(squeeze)
    assert not has_edges(Squeeze.none(LAYOUT))

    def energy(vector: jax.Array) -> jax.Array:
        above = (vector[ENTRY] - PRIOR.loc[RUN]) / PRIOR.scale[RUN]
        return 0.5 * above**2 + jnp.where(above > 0.0, 0.5 * (above / TOLD) ** 2, 0.0)

    def move(vector: jax.Array, key: jax.Array) -> tuple[jax.Array, jax.Array]:
        key_offer, key_accept = jax.random.split(key)
        offer = offer_start(key_offer, vector, squeeze, LAYOUT, DATA)
        rise = energy(offer.vector) - energy(vector) - offer.log_odds
        taken = jnp.log(jax.random.uniform(key_accept)) < -rise
        vector = jnp.where(taken, offer.vector, vector)
        return vector, vector

    begun = jnp.array([0.1, 5.0, 7.0, 9.0])
    keys = jax.random.split(jax.random.key(0), (40, 4_000))
    drawn = np.asarray(jax.vmap(lambda keys: jax.lax.scan(move, begun, keys)[1])(keys))
    above = (drawn[..., ENTRY] - 7.0) / 0.4
    width = 1.0 / np.hypot(1.0, 1.0 / TOLD)
    shares = (above > 0.0).mean(axis=1)
    error = shares.std() / np.sqrt(shares.size)
    assert abs(shares.mean() - width / (1.0 + width)) < 4.0 * error < 0.005
    assert above[above > 0.0].std() < TOLD
    # Nothing else moves.
    others = [0, 1, 3]
    np.testing.assert_array_equal(
        drawn[..., others], np.broadcast_to(begun, drawn.shape)[..., others]
    )
