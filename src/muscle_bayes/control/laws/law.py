"""What a control law is: readings in, duties out, once a period."""

from abc import abstractmethod
from typing import Any, NamedTuple

import equinox as eqx
from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar


class Measured(NamedTuple):
    """What the controller knows at one instant."""

    setpoint: Scalar
    """counts"""
    reading: Scalar
    """counts"""
    temperature: Float[Array, "2"]
    """Thermocouples' readings of sides A and B [C]."""


class Law(eqx.Module):
    """A discrete control law, called once a period."""

    @abstractmethod
    def initial(self) -> Any:
        """The state in which it starts."""

    @abstractmethod
    def update(self, state: Any, measured: Measured) -> tuple[Any, Float[Array, "2"]]:
        """The next state, and the duties (0 to 255) of heaters A and B until the next call."""
