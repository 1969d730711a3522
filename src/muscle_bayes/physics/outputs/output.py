"""What a sensor measures of a plant's motion."""

from abc import abstractmethod
from typing import NamedTuple

import equinox as eqx
from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.response import Response


class Beginning(NamedTuple):
    """Where a plant begins."""

    q: Scalar
    """Coordinate that a position sensor would show [rad or m]."""
    speed: Scalar
    """dq/dt [rad/s or m/s]."""


class Output(eqx.Module):
    """A measured quantity, in SI units."""

    @abstractmethod
    def shown(self, response: Response) -> Float[Array, " interval"]:
        """The quantity as readings show it, one value for each interval."""

    @abstractmethod
    def beginning(self, first: Scalar, slope: Scalar, place: Scalar) -> Beginning:
        """Where the plant begins: `first` is the first value of the quantity, `slope` its rate, `place`
        the first coordinate where the quantity does not tell it."""
