"""Derivatives of a simulation in any mode, from its few own inputs by forward mode."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array


def first_order(function: Callable[[Any, Any], Any]) -> Callable[..., Any]:
    """`function(x, aux)` as its first-order Taylor polynomial about x, by forward mode.

    Value and first derivative are those of the function; second derivatives are 0. For programs that always
    need the derivative: JAX traces less than with `with_forward_jacobian`, cheaper for values alone.
    """

    def polynomial(x: Any, aux: Any) -> Any:
        still = jax.tree.map(jax.lax.stop_gradient, x)
        value, rows = _jacobian(function, still, aux, still)
        move, _ = ravel_pytree(jax.tree.map(jnp.subtract, x, still))
        return jax.tree.map(lambda v, row: v + jnp.tensordot(move, row, axes=1), value, rows)

    return polynomial


def _jacobian(function: Callable[[Any, Any], Any], x: Any, aux: Any, like: Any) -> tuple[Any, Any]:
    """Value, and derivatives in the entries of x, leading; tangents are of the kind of `like`."""
    flat, of_flat = ravel_pytree(like)

    def along(direction: Array) -> Any:
        return jax.jvp(lambda y: function(y, aux), (x,), (of_flat(direction),))

    return jax.vmap(along, out_axes=(None, 0))(jnp.eye(flat.size, dtype=flat.dtype))


def with_forward_jacobian(function: Callable[[Any, Any], Any]) -> Callable[..., Any]:
    """`function(x, aux)` whose derivative in x is its Jacobian, found once by forward mode.

    `x` is an array, or several: what all lanes share and what is one lane's own are kept apart, so
    that a condition on the former stays one where lanes are simulated side by side.

    A run depends on some ten numbers while a posterior has thirty or more: differentiating each run
    in its own inputs, and the rest around it in reverse mode, costs a third or less, and lets
    reverse mode pass a solver that only knows forward mode. `aux` is held fixed.
    """

    @jax.custom_jvp
    def wrapped(x: Any, aux: Any) -> Any:
        return function(x, aux)

    @wrapped.defjvp
    def rule(primals: Any, tangents: Any) -> Any:
        (x, aux), (dx, _) = primals, tangents
        value, rows = _jacobian(function, x, aux, dx)
        flat, _ = ravel_pytree(dx)
        return value, jax.tree.map(lambda row: jnp.tensordot(flat, row, axes=1), rows)

    return wrapped
