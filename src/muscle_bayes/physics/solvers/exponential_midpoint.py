"""States that relax quickly, moved to second order whatever the step."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar

Memory = dict[str, Float[Array, "2"]]
"""States of the effects with memory on sides A and B, by name."""


def mean_decay(z: Array, straight: float = 1e-3) -> Array:
    """(exp(z) - 1) / z; from its series where |z| is below `straight`."""
    near = jnp.abs(z) < straight
    safe = jnp.where(near, 1.0, z)
    return jnp.where(near, 1.0 + z * (0.5 + z / 6.0), jnp.expm1(safe) / safe)


def exponential_step(
    rates: Callable[[Memory], Memory], held: Memory, origin: Memory, duration: Scalar
) -> Memory:
    """States after `duration` [s] from `origin`, their rates straight about `held`.

        s(h) = s0 + h phi(h r') (r + r' (s0 - s)),   phi(z) = (exp(z) - 1) / z,   r = rate(s)

    The exponential Rosenbrock-Euler rule (Hochbruck and Ostermann, Acta Numerica 19, 2010, section
    2.4). Each state's rate depends on itself alone while all else is held, and r' is taken as 0
    where it is positive. Second order, and L-stable, where `held` is the state half a step on.
    """

    def moved(name: str) -> Array:
        def rate_at(value: Array) -> Array:
            return rates(held | {name: value})[name]

        rate, slope = jax.jvp(rate_at, (held[name],), (jnp.ones_like(held[name]),))
        slope = jnp.minimum(slope, 0.0)
        pull = rate + slope * (origin[name] - held[name])
        return origin[name] + duration * mean_decay(slope * duration) * pull

    return {name: moved(name) for name in held}
