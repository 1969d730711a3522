"""A maximum of the posterior density, and the descent to it from one point."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.model.density import log_prior, potential_errors_and_scales
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.running.program import Program
from muscle_bayes.inference.running.programs import potential_at
from muscle_bayes.inference.search.damped_steps import damped_move

MAX_STEPS = 60
LEAST_GAIN = 1e-3
"""Decrease of the potential below which a descent ends."""
LEAST_PRECISION = 1e-4
"""Least prior precision of a direction, for flat or concave priors."""


class Mode(NamedTuple):
    """A maximum of the posterior density."""

    vector: Float[Array, " n"]
    """Unconstrained."""
    potential: float
    """Negative log density there."""
    information: Float[Array, "n n"]
    """Fisher information of the likelihood (Gauss-Newton) plus prior precision."""
    steps: int


@Program
def curvature(vector, layout: Layout, data: Data):
    """Gradient of the potential, and Gauss-Newton information plus prior precision."""
    gradient, jacobian = jax.jacfwd(potential_errors_and_scales)(vector, layout, data)

    def slope(vector: Array) -> Array:
        return jax.grad(log_prior)(vector, layout, data)

    # Priors are independent of each other: their Hessian is diagonal.
    prior = -jax.jvp(slope, (vector,), (jnp.ones_like(vector),))[1]
    return gradient, jacobian.T @ jacobian + jnp.diag(jnp.maximum(prior, LEAST_PRECISION))


class Descent(NamedTuple):
    """Where a descent has ended."""

    vector: Float[Array, " n"]
    """Unconstrained."""
    potential: float
    steps: int


def descend(vector: Array, layout: Layout, data: Data, free: np.ndarray, limit: int) -> Descent:
    """Levenberg-Marquardt on the potential in the free entries: damped until a step descends."""
    value, damping, step = potential_at(vector, layout, data), 1e-2, 0
    gradient, information = curvature(vector, layout, data)
    chosen = np.flatnonzero(free)
    while step < limit:
        step += 1
        part = np.asarray(information)[np.ix_(chosen, chosen)]
        move = np.zeros(vector.shape)
        slope = np.asarray(gradient)[chosen]
        move[chosen] = damped_move(part, slope, damping)
        further = vector + move
        trial = potential_at(further, layout, data)
        if trial < value:
            gain, vector, value = value - trial, further, trial
            damping = max(damping * 0.2, 1e-9)
            if gain < LEAST_GAIN:
                break
            gradient, information = curvature(vector, layout, data)
        else:
            damping *= 6.0
            if damping > 1e8:
                break
    return Descent(vector, value, step)


def to_mode(vector: Array, layout: Layout, data: Data) -> Mode:
    """Descend in all entries, as far as it goes."""
    found = descend(vector, layout, data, np.ones(vector.size), MAX_STEPS)
    information = curvature(found.vector, layout, data)[1]
    return Mode(found.vector, found.potential, information, found.steps)


def refine(mode: Mode, layout: Layout, data: Data) -> Mode:
    """The local maximum to which a mode of slightly different data leads."""
    return to_mode(mode.vector, layout, data)
