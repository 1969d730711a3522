"""What an effect is: a named correction of one quantity of the plant."""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import equinox as eqx
from numpyro.distributions import Distribution

from muscle_bayes.physics.linkage import Scalar

Port = Literal["torque", "tension", "offset", "damper", "temperature", "reading"]
PORTS: tuple[Port, ...] = ("torque", "tension", "offset", "damper", "temperature", "reading")


class Scales(NamedTuple):
    """Characteristic magnitudes of a set of runs, by which weakly informative priors are scaled.

    They come from metadata, inputs and the range of motion, never from a fit.
    """

    force: float
    """Generalised force that drives the rotor [N m or N]."""
    speed: float
    """Speed of the coordinate [rad/s or m/s]."""
    tension: float
    """Tension of the elements [N]."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect: at `off` the effect is exactly the identity."""

    unit: str
    off: float
    prior: Callable[[Scales], Distribution]
    meaning: str


class Signals(NamedTuple):
    """What an effect may look at, at one instant. Muscle signals are those of the side it acts on."""

    q: Scalar
    """Coordinate [rad or m]."""
    speed: Scalar
    """dq/dt [rad/s or m/s]."""
    load: Scalar
    """Hanging mass [kg]."""
    strain: Scalar
    """sigma = (L - L_base) / L_base."""
    hyst: Scalar
    """sigma_hyst."""
    temperature: Scalar
    """Temperature of the muscle [C]."""


class Effect(eqx.Module):
    """Maps the value on one port of the plant to a corrected value on the same port.

    A subclass is one file: its fields are its parameters, described in `parameters`; its docstring
    gives equation, symbols with units, and source. `plant + SomeEffect(...)` composes.
    """

    name: ClassVar[str]
    port: ClassVar[Port]
    dissipative: ClassVar[bool]
    parameters: ClassVar[Mapping[str, Parameter]]

    @abstractmethod
    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        """The corrected value, in the port's unit."""

    @classmethod
    def off(cls) -> "Effect":
        """The effect with every parameter at its off value."""
        return cls(**{key: parameter.off for key, parameter in cls.parameters.items()})


class TemperatureFilter(eqx.Module):
    """An effect on the temperature port that remembers: advanced exactly over each interval."""

    name: ClassVar[str]
    port: ClassVar[Port] = "temperature"
    dissipative: ClassVar[bool] = False
    parameters: ClassVar[Mapping[str, Parameter]]

    @abstractmethod
    def advance(self, memory: Scalar, before: Scalar, after: Scalar, duration: Scalar) -> Scalar:
        """Temperature [C] after `duration` [s] in which the input went straight from before to after."""

    @classmethod
    def off(cls) -> "TemperatureFilter":
        """The effect with every parameter at its off value."""
        return cls(**{key: parameter.off for key, parameter in cls.parameters.items()})
