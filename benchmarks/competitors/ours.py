"""This project's own gradient, of the density that the sampler draws from."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from benchmarks.competitors.protocol import Competitor, Coordinates, Gradient
from muscle_bayes.inference.model.density import constrain, potential
from muscle_bayes.inference.model.lane_model import predictions
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.running.programs import predictions_at

_gradient = jax.jit(jax.value_and_grad(potential), static_argnames="layout")


@partial(jax.jit, static_argnames="layout")
def _sensitivities(vector: Array, layout: Layout, data: Data) -> Any:
    def readings(vector: Array) -> Array:
        (predicted,) = predictions(constrain(vector, layout, data), layout, data)
        return predicted.reading

    return jax.jvp(readings, (vector,), (jnp.ones_like(vector),))


class Ours(Competitor):
    """Quasi-static steps on the schedule's nodes, each run's Jacobian by forward mode."""

    name = "muscle_bayes"
    settings = "the schedule's nodes"

    def coordinates(self, vector: Float[np.ndarray, " n"]) -> Coordinates:
        (lanes,) = self.problem.data.lanes
        (predicted,) = predictions_at(vector, self.problem.layout, self.problem.data)
        # Beyond the longest run there is only padding.
        real = np.count_nonzero(np.diff(lanes.schedule.time), axis=1).max()
        return np.asarray(predicted.reading * lanes.scale[:, None])[:, :real]

    def __call__(self, vector: Float[np.ndarray, " n"]) -> Gradient:
        value, gradient = _gradient(vector, self.problem.layout, self.problem.data)
        return -float(value), -np.asarray(gradient)

    def sensitivities(self, vector: Float[np.ndarray, " n"]) -> Any:
        """The simulation alone: readings, and all their derivatives on the way to one direction's."""
        layout, data = self.problem.layout, self.problem.data
        return jax.block_until_ready(_sensitivities(vector, layout, data))
