"""The loop over a drive's nodes, for derivatives by forward mode."""

from typing import Any

import diffrax
import equinox as eqx
import equinox.internal as eqxi
import jax
import jax.numpy as jnp
from jaxtyping import Array


class NodeLoop(diffrax.AbstractAdjoint):
    """What `diffrax.ForwardMode` does, for `StepToNodes` and states saved at every step.

    The loop ends with the last step that lasts in any of a batch: runs padded to one length cost no more
    than the longest. All that it carries has a batch and derivatives from the start, so that JAX
    transforms a step once; in diffrax's loop, whose buffers begin as constants, several times.
    """

    def loop(
        self,
        *,
        args: Any,
        terms: Any,
        solver: diffrax.AbstractSolver,
        stepsize_controller: Any,
        init_state: Any,
        **others: Any,
    ) -> Any:
        times = stepsize_controller.ts
        lasting = jnp.sum(times[:-1] < times[-1], dtype=jnp.int32)
        steps = eqxi.unvmap_max(jnp.maximum(lasting, 1))
        begin = _alike((init_state.y, init_state.solver_state), init_state.y.q)
        saved = jax.tree.map(
            lambda leaf: jnp.broadcast_to(leaf, (len(times) - 1, *leaf.shape)), begin[0]
        )

        def step(count: Array, carried: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
            y, state, saved = carried
            y, _, _, state, _ = solver.step(
                terms, times[count], times[count + 1], y, args, state, jnp.asarray(False)
            )
            saved = jax.tree.map(lambda all_, one: all_.at[count].set(one), saved, y)
            return y, state, saved

        y, state, saved = jax.lax.fori_loop(0, steps, step, (*begin, saved))
        taken = jnp.arange(len(times) - 1) < steps

        def lasts(all_: Array, last: Array) -> Array:
            return jnp.where(taken.reshape(-1, *[1] * last.ndim), all_, last)

        kept = init_state.save_state
        kept = eqx.tree_at(
            lambda one: (one.ts, one.ys), kept, (times[1:], jax.tree.map(lasts, saved, y))
        )
        final = eqx.tree_at(
            lambda one: (one.y, one.solver_state, one.save_state, one.num_steps),
            init_state,
            (y, state, kept, steps),
        )
        return final, {}


def _alike(tree: Any, reference: Array) -> Any:
    """The tree's numbers, all with the batch and the derivatives of `reference`."""
    nothing = 0.0 * reference
    none = 0 * jnp.isnan(reference)

    def one(leaf: Array) -> Array:
        leaf = jnp.asarray(leaf)
        if leaf.dtype == bool:
            return leaf
        return leaf + (
            nothing if jnp.issubdtype(leaf.dtype, jnp.inexact) else none.astype(leaf.dtype)
        )

    return jax.tree.map(one, tree)
