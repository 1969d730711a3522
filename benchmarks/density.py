"""The log posterior around a competitor's simulation: cheap, smooth, and the same for all."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.inference.model.density import constrain, potential_given
from muscle_bayes.inference.model.lane_model import (
    LanePrediction,
    Values,
    physical_of,
    plant_of,
    zeros_of,
)
from muscle_bayes.inference.model.lanes import Lanes
from muscle_bayes.inference.model.muscle_prior import first_hyst
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.physics.simulation import at_rest, initial_state


def means(values: Any) -> Any:
    """Means over intervals from values at the course's instants, along the first axis.

    (beginning + 2 middle + end) / 4, as our model takes them.
    """
    return 0.25 * (values[:-1:2] + 2.0 * values[1::2] + values[2::2])


def lane_inputs(values: Values, layout: Layout, data: Data) -> Float[Array, "lane input"]:
    """What each lane's ODE depends on (`problem.INPUTS`), from the sampled values."""
    (lanes,) = data.lanes
    physical = physical_of(values, layout, data)
    zero = zeros_of(values, lanes, "slow", False)
    start = lanes.scale * (values["slow.start"][lanes.run] - zero)
    first = first_hyst(values["slow.hyst_lag"], values, data.tension)[lanes.run]
    if physical.muscle is None or physical.friction is None:
        raise ValueError("competitors know muscles only")
    shared = jnp.stack([physical.friction, *jax.tree.leaves(physical.muscle)])

    def one(lane: Lanes, q: Array, hyst: Array) -> Array:
        plant = plant_of(lane.plant, physical, layout)
        state = initial_state(plant, lane.schedule, q, 0.0, hyst)
        q = at_rest(plant, lane.schedule, state).q
        return jnp.concatenate([shared, jnp.stack([q, hyst])])

    return jax.vmap(one)(lanes, start, first)


@partial(jax.jit, static_argnames="layout")
def inputs_of(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, "lane input"]:
    """`lane_inputs` from the unconstrained vector."""
    return lane_inputs(constrain(vector, layout, data), layout, data)


def log_posterior(
    vector: Float[Array, " n"], q: Float[Array, "lane interval"], layout: Layout, data: Data
) -> Float[Array, ""]:
    """Log posterior density of the unconstrained vector where the lanes' mean coordinates are known."""
    (lanes,) = data.lanes
    missing = lanes.reading.shape[1] - q.shape[1]
    reading = jnp.pad(q, ((0, 0), (0, missing)), mode="edge") / lanes.scale[:, None]
    predicted = LanePrediction(reading, None, jnp.isfinite(q).all(axis=1) * 1.0)
    return -potential_given([predicted], vector, layout, data)


@partial(jax.jit, static_argnames="layout")
def value_and_gradient(
    vector: Float[Array, " n"],
    q: Float[Array, "lane interval"],
    jacobian: Float[Array, "lane interval input"],
    layout: Layout,
    data: Data,
) -> tuple[Float[Array, ""], Float[Array, " n"]]:
    """Log posterior and its gradient from mean coordinates [rad] and their derivatives in the inputs.

    The straight line through q with slope `jacobian` has q's value and derivative at the vector.
    """

    def along(vector: Array) -> Array:
        inputs = lane_inputs(constrain(vector, layout, data), layout, data)
        change = inputs - jax.lax.stop_gradient(inputs)
        moved = q + jnp.einsum("lti,li->lt", jacobian, change)
        return log_posterior(vector, moved, layout, data)

    return jax.value_and_grad(along)(vector)
