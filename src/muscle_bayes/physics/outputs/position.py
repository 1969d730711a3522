"""The coordinate is measured."""

from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.outputs.output import Beginning, Output
from muscle_bayes.physics.response import Response


class Position(Output):
    """q [rad or m], through the effects on the port `reading`."""

    def shown(self, response: Response) -> Float[Array, " interval"]:
        return response.averaged

    def beginning(self, first: Scalar, slope: Scalar, place: Scalar) -> Beginning:
        return Beginning(first, slope)
