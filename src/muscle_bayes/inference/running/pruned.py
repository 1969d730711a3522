"""Functions from which JAX transforms no more than their results need."""

from collections.abc import Callable
from functools import wraps

import jax
from jax.interpreters import partial_eval


def pruned[**P, R](function: Callable[P, R]) -> Callable[P, R]:
    """`function` of arrays without what its result does not depend on (dead-code elimination).

    XLA drops dead code as well, but only after JAX has carried it through every derivative and batch:
    of a muscle's quasi-static step with all effects, more than half.
    """

    @wraps(function)
    def lean(*args: P.args, **kwargs: P.kwargs) -> R:
        leaves, structure = jax.tree.flatten((args, kwargs))

        def flat(*leaves: jax.Array) -> R:
            args, kwargs = jax.tree.unflatten(structure, leaves)
            return function(*args, **kwargs)

        traced, shape = jax.make_jaxpr(flat, return_shape=True)(*leaves)
        whole = partial_eval.convert_constvars_jaxpr(traced.jaxpr)
        needed, _ = partial_eval.dce_jaxpr(whole, True, instantiate=True)
        found = jax.core.eval_jaxpr(needed, (), *traced.consts, *leaves)
        return jax.tree.unflatten(jax.tree.structure(shape), found)

    return lean
