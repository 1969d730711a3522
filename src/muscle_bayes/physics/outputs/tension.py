"""The force of side A's element is measured, as by a load cell; the coordinate is imposed."""

from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.outputs.output import Beginning, Output
from muscle_bayes.physics.response import Response


class Tension(Output):
    """Tension [N] of side A's element, or its torque [N m] where it has no length."""

    def shown(self, response: Response) -> Float[Array, " interval"]:
        return response.averaged

    def beginning(self, first: Scalar, slope: Scalar, place: Scalar) -> Beginning:
        return Beginning(place, slope)
