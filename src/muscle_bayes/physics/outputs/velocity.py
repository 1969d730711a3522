"""The rate of the coordinate is measured, as by a gyroscope or a tachometer."""

from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.outputs.output import Beginning, Output
from muscle_bayes.physics.response import Response


class Velocity(Output):
    """dq/dt [rad/s or m/s]; where the plant begins is not measured."""

    def shown(self, response: Response) -> Float[Array, " interval"]:
        return response.speed

    def beginning(self, first: Scalar, slope: Scalar, place: Scalar) -> Beginning:
        return Beginning(place, first)
