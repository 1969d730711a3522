"""The state of a plant, and what is imposed on it at one instant."""

from collections.abc import Mapping
from typing import NamedTuple

from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar


class Drive(NamedTuple):
    """What is imposed on the plant at one instant."""

    temperature: Float[Array, "2"]
    """Muscle temperature of sides A and B [C]."""
    load: Scalar
    """Hanging mass [kg]."""
    applied: Scalar
    """Logged drive: a generalised force [N m or N], or what the actuator makes one of [A, V or duty]."""


Pair = tuple[Scalar, Scalar]
"""What is so on sides A and B. Scalars, not an array: that compiles to a third of the work."""


class PlantState(NamedTuple):
    """State of the equation of motion; as the value of a vector field, its derivative in time."""

    q: Scalar
    """Coordinate [rad or m]."""
    speed: Scalar
    """dq/dt [rad/s or m/s]."""
    hyst: Float[Array, "2"] | Pair
    """sigma_hyst of sides A and B."""
    memory: Mapping[str, Float[Array, "2"] | Pair]
    """States of the effects with memory on sides A and B, by name."""
