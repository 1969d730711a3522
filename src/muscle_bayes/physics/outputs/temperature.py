"""The temperature of a heated side is measured, beside the power that heats it."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.outputs.output import Beginning, Output
from muscle_bayes.physics.response import Response
from muscle_bayes.physics.schedule import Schedule


class Temperature(Output):
    """Temperature of a side [C], as its heater has it."""

    side: int = eqx.field(static=True)
    """0: A, 1: B"""

    def shown(self, response: Response) -> Float[Array, " interval"]:
        return response.averaged

    def beginning(self, first: Scalar, slope: Scalar, place: Scalar) -> Beginning:
        return Beginning(place, slope)

    def response(self, schedule: Schedule) -> Response:
        """Mean temperature of each interval of a schedule that holds temperatures; nothing moves."""
        heat = schedule.temperature[:, self.side]
        mean = 0.5 * (heat[1:] + heat[:-1])
        still = jnp.zeros(mean.shape)
        finite = jnp.isfinite(mean).all()
        return Response(mean, mean, jnp.zeros((mean.size, 2)), still, finite)
