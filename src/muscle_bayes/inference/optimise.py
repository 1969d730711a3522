"""The most probable parameters, and the Fisher information there."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.density import log_prior, potential, standardised_errors, unconstrain
from muscle_bayes.inference.problem import Data, Layout

PRIOR_DRAWS = 128
"""Draws of the prior among which optimisation starts."""
STARTS = 4
"""Best draws that are optimised."""
MAX_STEPS = 60
LEAST_PRECISION = 1e-4
"""Least prior precision of a direction, for flat or concave priors."""


class Mode(NamedTuple):
    """A maximum of the posterior density."""

    vector: Float[Array, "n"]
    """Unconstrained."""
    potential: float
    """Negative log density there."""
    information: Float[Array, "n n"]
    """Fisher information of the likelihood (Gauss-Newton) plus prior precision."""
    steps: int


@partial(jax.jit, static_argnames="layout")
def _draw(key: Array, layout: Layout, data: Data) -> Float[Array, "n"]:
    keys = jax.random.split(key, len(layout.shapes))
    values = {
        name: data.priors[name].sample(one) for one, (name, _) in zip(keys, layout.shapes, strict=True)
    }
    return unconstrain(values, layout, data)


@partial(jax.jit, static_argnames="layout")
def _potential(vector, layout: Layout, data: Data):
    return potential(vector, layout, data)


@partial(jax.jit, static_argnames="layout")
def _potentials(vectors, layout: Layout, data: Data):
    return jax.lax.map(lambda v: potential(v, layout, data), vectors, batch_size=16)


@partial(jax.jit, static_argnames="layout")
def _curvature(vector, layout: Layout, data: Data):
    """Gradient of the potential, and Gauss-Newton information plus prior precision."""
    gradient = jax.jacfwd(potential)(vector, layout, data)
    jacobian = jax.jacfwd(standardised_errors)(vector, layout, data)
    prior = -jax.hessian(log_prior)(vector, layout, data)
    values, vectors = jnp.linalg.eigh(0.5 * (prior + prior.T))
    prior = (vectors * jnp.maximum(values, LEAST_PRECISION)) @ vectors.T
    return gradient, jacobian.T @ jacobian + prior


def _descend(vector: Array, layout: Layout, data: Data) -> Mode:
    """Levenberg-Marquardt on the potential: Gauss-Newton steps, damped until they descend."""
    value, damping, step = float(_potential(vector, layout, data)), 1e-2, 0
    gradient, information = _curvature(vector, layout, data)
    while step < MAX_STEPS:
        step += 1
        scale = jnp.diag(jnp.diag(information))
        move = -jnp.linalg.solve(information + damping * scale, gradient)
        # A move of many prior standard deviations at once leaves the region the model is good in.
        move = move * jnp.minimum(1.0, 3.0 / jnp.max(jnp.abs(move)))
        trial = float(_potential(vector + move, layout, data))
        if trial < value:
            gain, vector, value = value - trial, vector + move, trial
            damping = max(damping * 0.2, 1e-9)
            gradient, information = _curvature(vector, layout, data)
            if gain < 1e-4:
                break
        else:
            damping *= 6.0
            if damping > 1e8:
                break
    return Mode(vector, value, information, step)


def find_mode(
    key: Array,
    layout: Layout,
    data: Data,
    report: Callable[[str], None] = lambda text: None,
) -> Mode:
    """The best of several local maxima, started from the most probable of many prior draws.

    Raises MuscleBayesError when no prior draw gives a finite density.
    """
    draws = jax.vmap(lambda one: _draw(one, layout, data))(jax.random.split(key, PRIOR_DRAWS))
    values = np.asarray(_potentials(draws, layout, data))
    order = np.argsort(np.where(np.isfinite(values), values, np.inf))
    if not np.isfinite(values[order[0]]):
        raise MuscleBayesError(
            "the model cannot be simulated anywhere in the prior for these runs; check the geometry "
            "in their metadata (lengths in m, masses in kg, angles in rad)"
        )
    modes = []
    for count, start in enumerate(order[:STARTS]):
        modes.append(_descend(draws[start], layout, data))
        report(f"start {count + 1} of {STARTS}: -log density {modes[-1].potential:.2f}")
    return min(modes, key=lambda mode: mode.potential)
