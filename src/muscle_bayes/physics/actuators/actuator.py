"""What turns a logged drive into a force on the coordinate."""

from abc import abstractmethod

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.unknown import Part


class Actuator(Part):
    """The force of a motor, or of whatever else drives the rig from outside."""

    @abstractmethod
    def force(self, signal: Scalar, speed: Scalar) -> Scalar:
        """Generalised force [N m or N] at a logged signal [its unit] and a speed [rad/s or m/s]."""
