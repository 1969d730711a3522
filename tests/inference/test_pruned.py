"""Functions without what their results do not depend on."""

import jax
import jax.numpy as jnp
import numpy as np

from muscle_bayes.inference.running.pruned import pruned


def wasteful(x: dict[str, jax.Array], times: int) -> jax.Array:
    both = jax.jit(lambda y: (jnp.sin(y) * times, jnp.exp(jnp.cos(y) ** 3)))
    return both(x["used"])[0] + 0.0 * jnp.sum(x["unused"].shape[0])


def primitives(function) -> str:
    x = {"used": jnp.ones(3), "unused": jnp.ones(2)}
    return str(jax.make_jaxpr(lambda x: jax.jvp(lambda y: function(y, 2), (x,), (x,)))(x))


def test_value_and_derivatives_stay():
    x = {"used": jnp.array([0.1, 0.7]), "unused": jnp.ones(2)}
    for way in (lambda f: f(x, 2), lambda f: jax.jacfwd(f)(x, 2), lambda f: jax.jacrev(f)(x, 2)):
        for one, other in zip(
            *map(jax.tree.leaves, map(way, (wasteful, pruned(wasteful)))), strict=True
        ):
            np.testing.assert_array_equal(one, other)


def test_what_no_result_needs_is_not_differentiated():
    assert " exp " in primitives(wasteful)
    assert " exp " not in primitives(pruned(wasteful))
