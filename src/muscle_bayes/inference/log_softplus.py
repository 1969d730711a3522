"""log(log(1 + exp(x))): linear in x far below 0, the logarithm of x far above."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def log_softplus(x: Float[Array, ""]) -> Float[Array, ""]:
    """log(log(1 + exp(x)))."""
    # Far below 0 log(1 + exp(x)) is exp(x): the logarithm must not see it vanish.
    return jnp.where(x > -30.0, jnp.log(jax.nn.softplus(jnp.maximum(x, -30.0))), x)


def log_softplus_slope(x: Float[Array, ""]) -> Float[Array, ""]:
    """Log of the derivative of `log_softplus`."""
    return jax.nn.log_sigmoid(x) - log_softplus(x)


def softplus_inverse(log_y: Float[Array, ""]) -> Float[Array, ""]:
    """x with log_softplus(x) = log_y."""
    y = jnp.exp(log_y)
    return y + jnp.log(-jnp.expm1(-y))
