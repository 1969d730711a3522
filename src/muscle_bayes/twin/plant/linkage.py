"""One side of the fixture: an element between a rotor pin and a stator pin (eq. 7-10)."""

from dataclasses import dataclass
from math import cos, sin, sqrt

from muscle_bayes.twin.plant.springs import Puller


@dataclass
class Side:
    """Side A where direction is +1; side B, its mirror image, where direction is -1.

    Mirrored, both sides share one formula: side B sees -theta and its torque turns the other way.
    """

    element: Puller
    rotor_radius: float
    anchor_x: float
    anchor_y: float
    direction: int = 1

    def length(self, angle: float) -> float:
        """Pin-to-pin length (eq. 7, 8), m."""
        angle *= self.direction
        r = self.rotor_radius
        return sqrt((self.anchor_x - r * cos(angle)) ** 2 + (self.anchor_y + r * sin(angle)) ** 2)

    def torque(self, angle: float) -> float:
        """Torque on the rotor (eq. 9, 10), N m."""
        direction = self.direction
        angle *= direction
        r = self.rotor_radius
        x = self.anchor_x
        y = self.anchor_y
        c = cos(angle)
        s = sin(angle)
        across = x - r * c
        along = y + r * s
        length = sqrt(across * across + along * along)
        return -direction * self.element.tension(length) * r / length * (y * c + x * s)
