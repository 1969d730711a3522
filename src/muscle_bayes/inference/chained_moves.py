"""Many cheap Metropolis moves by a surrogate's density, of which one simulation judges the end."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.inference.proposed_move import ProposedMove


def chained(
    key: Array,
    vector: Float[Array, " n"],
    energy_at: Callable[[Array], Array],
    offer_at: Callable[[Array, Array], ProposedMove],
    count: int,
) -> ProposedMove:
    """Where `count` moves lead, each made by `offer_at(key, vector)` and accepted by `energy_at(vector)`.

    That is the surrogate's negative log density, which leads from one end to the other as often as back:
    its odds are taken off (Liu, Monte Carlo Strategies in Scientific Computing, section 9.4, 2001).
    """

    # First the energy here. One loop: a program that looks at it in one place compiles sooner.
    def step(index: Array, now: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        here, at, begun = now
        key_offer, key_accept = jax.random.split(jax.random.fold_in(key, index))
        made = offer_at(key_offer, here)
        first = index == 0
        there = jnp.where(first, here, made.vector)
        level = energy_at(there)
        chance = jnp.log(jax.random.uniform(key_accept))
        taken = first | (chance < at - level + made.log_odds)
        return (
            jnp.where(taken, there, here),
            jnp.where(taken, level, at),
            jnp.where(first, level, begun),
        )

    none = jnp.zeros(())
    end, at, begun = jax.lax.fori_loop(0, 1 + count, step, (vector, none, none))
    return ProposedMove(end, at - begun)
