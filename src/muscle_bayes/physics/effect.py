"""What an effect is: a named correction of one quantity of the plant."""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple, Self

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float
from numpyro import distributions as dist

from muscle_bayes.physics.linkage import Scalar

Port = Literal[
    "torque",
    "friction",
    "tension",
    "offset",
    "modulus",
    "damper",
    "flow",
    "temperature",
    "reading",
]
PORTS: dict[Port, str] = {
    "torque": "generalised force on the rotor, but for dry friction [N m or N]",
    "friction": "dry friction [N m or N]",
    "tension": "tension of the muscle, beside MODULUS, OFFSET and HYST [N]",
    "offset": "sigma_offset [1]",
    "modulus": "stiffness of MODULUS, force per unit strain [N]",
    "damper": "coefficient of HYST's damper [N s/m]",
    "flow": "force over HYST's damper [N]",
    "temperature": "temperature of the muscle [C]",
    "reading": "coordinate that the sensor shows [rad or m]",
}
"""What each port carries."""
MUSCLE_PORTS: tuple[Port, ...] = (
    "tension",
    "offset",
    "modulus",
    "damper",
    "flow",
    "temperature",
)
"""Ports that only a muscle has."""


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
    range: float
    """Range of the coordinate [rad or m]."""
    rest: float = 0.0
    """Middle of the coordinate's course [rad or m]."""
    duration: float = 1.0
    """Of the longest run [s]."""
    power: float = 1.0
    """RMS of the heaters' power, or of what stands for it [its unit]; 1 where none is logged."""
    signal: float = 1.0
    """RMS of the logged drive [its unit]; 1 where there is none."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect: at `off` the effect is exactly the identity."""

    unit: str
    off: float
    prior: Callable[[Scales], dist.Distribution]
    meaning: str

    def weakened(self, value: Array, factor: Array | float) -> Array:
        """A value of an effect that is weaker by a factor.

        A parameter that is not 0 where the effect is off, a speed or a time, says where the effect acts and
        not how strongly: it stays as it is.
        """
        return value if self.off else factor * value


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
    room: Scalar
    """Temperature of the room [C]; zero where there is no muscle."""
    tension: Scalar
    """Tension of MODULUS, OFFSET and HYST in series [N]; zero on the ports from which it follows
    (temperature, offset, modulus) and where there is no muscle."""
    pull: Scalar
    """Sum of the magnitudes of the generalised forces of both elements, of the load and of what drives
    the rotor [N m or N]; zero on all ports but friction."""
    driving: Scalar
    """Generalised force of the load and of what drives the rotor [N m or N]; zero on all ports but
    torque."""
    memory: Mapping[str, Scalar]
    """States of the muscle's effects with memory, by name."""


class Effect(eqx.Module):
    """Maps the value on one port of the plant to a corrected value on the same port.

    A subclass is one file: its fields are its parameters, described in `parameters`; its docstring
    gives equation, symbols with units, and source. `plant + SomeEffect(...)` composes.
    """

    name: ClassVar[str]
    port: ClassVar[Port]
    dissipative: ClassVar[bool]
    scanned: ClassVar[int] = 0
    """Weak draws of the prior that a search tries; some where the likelihood has many maxima."""
    parameters: ClassVar[Mapping[str, Parameter]]

    @abstractmethod
    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        """The corrected value, in the port's unit."""

    @classmethod
    def off(cls) -> Self:
        """The effect with every parameter at its off value."""
        return cls(**{key: parameter.off for key, parameter in cls.parameters.items()})


class MemoryEffect(Effect):
    """An effect on one of MUSCLE_PORTS that remembers: it owns a scalar state of each muscle.

    `signals.memory[self.name]` is that state, in `rate` as well as in `__call__`. The solvers move
    it by `rate`, to second order in the step, and hold it while coordinate and HYST move.
    """

    @abstractmethod
    def rate(self, signals: Signals) -> Scalar:
        """d state/dt [unit of the state per s]; should not rise with the state."""

    def initial(self) -> Scalar:
        """The state before the muscle has long hung as it does in the first row."""
        return jnp.zeros(())

    def begun(self, rest: Scalar) -> Scalar:
        """The state at the first row; `rest`: after the muscle has long hung as it does there."""
        return rest


class CourseFilter(eqx.Module):
    """An effect that looks at the whole course of what its port carries."""

    name: ClassVar[str]
    port: ClassVar[Port]
    dissipative: ClassVar[bool] = False
    scanned: ClassVar[int] = 0
    parameters: ClassVar[Mapping[str, Parameter]]

    @abstractmethod
    def __call__(
        self, time: Float[Array, " node"], course: Float[Array, " node"]
    ) -> Float[Array, " node"]:
        """The course as it passes, at the same times [s]; intervals of no length are padding."""

    @classmethod
    def off(cls) -> Self:
        """The effect with every parameter at its off value."""
        return cls(**{key: parameter.off for key, parameter in cls.parameters.items()})


class ReadingFilter(CourseFilter):
    """An effect on the reading port: from the coordinate's course to the one that the sensor shows.

    [rad or m]. The first value passes unchanged: a run's zero and first position are unknowns anyway.
    """

    port: ClassVar[Port] = "reading"


class TemperatureFilter(CourseFilter):
    """An effect on the temperature port: from the heater's course to the muscle's [C].

    The course is linear between the nodes. The filter must be linear in the course and the same at all
    times: derivatives of courses pass as courses do.
    """

    port: ClassVar[Port] = "temperature"

    def advance(self, late: Scalar, before: Scalar, after: Scalar, duration: Scalar) -> Scalar:
        """The muscle's temperature [C] where nothing is logged but the plant runs on, `late` having
        been `duration` [s] ago, while the input went straight from before to after.

        As it is, unless said: what shifts a log does not delay a plant.
        """
        return after
