"""A drive that is logged as the force it exerts."""

from muscle_bayes.physics.actuators.actuator import Actuator
from muscle_bayes.physics.linkage import Scalar


class KnownForce(Actuator):
    """Q = u, the logged force u [N m or N]."""

    def force(self, signal: Scalar, speed: Scalar) -> Scalar:
        return signal
