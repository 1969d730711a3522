"""States that relax quickly, moved to second order whatever the step."""

from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.state import Pair

Memory = dict[str, Pair]
"""States of the effects with memory on sides A and B, by name."""


def mean_decay(z: Array, straight: float = 1e-3) -> Array:
    """(exp(z) - 1) / z; from its series where |z| is below `straight`."""
    near = jnp.abs(z) < straight
    safe = jnp.where(near, 1.0, z)
    return jnp.where(near, 1.0 + z * (0.5 + z / 6.0), jnp.expm1(safe) / safe)


def paired(memory: Mapping[str, Array | Pair]) -> Memory:
    """Both sides' states apart."""
    return {name: (states[0], states[1]) for name, states in memory.items()}


def stacked(memory: Memory) -> dict[str, Float[Array, "2"]]:
    """Both sides' states as arrays."""
    return {name: jnp.stack(states) for name, states in memory.items()}


def exponential_step(
    rates: Callable[[Memory], Mapping[str, Any]],
    held: Memory,
    origin: Memory,
    duration: Scalar,
    sides: tuple[int, ...] = (0, 1),
) -> Memory:
    """States after `duration` [s] from `origin`, their rates straight about `held`.

        s(h) = s0 + h phi(h r') (r + r' (s0 - s)),   phi(z) = (exp(z) - 1) / z,   r = rate(s)

    The exponential Rosenbrock-Euler rule (Hochbruck and Ostermann, Acta Numerica 19, 2010, section
    2.4). Each state's rate depends on itself alone while all else is held, and r' is taken as 0
    where it is positive. Second order, and L-stable, where `held` is the state half a step on. Only
    the states of `sides` move.
    """

    def moved(name: str, side: int) -> Scalar:
        if side not in sides:
            return origin[name][side]
        at, begin = held[name][side], origin[name][side]

        def rate_at(value: Scalar) -> Scalar:
            other = held[name][1 - side]
            pair = (value, other) if side == 0 else (other, value)
            return rates(held | {name: pair})[name][side]

        rate, slope = jax.jvp(rate_at, (at,), (jnp.ones_like(at),))
        slope = jnp.minimum(slope, 0.0)
        pull = rate + slope * (begin - at)
        return begin + duration * mean_decay(slope * duration) * pull

    return {name: (moved(name, 0), moved(name, 1)) for name in held}
