"""The simulated bench: fixture, elements, heaters, sensors and what is true of them."""

from dataclasses import field
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, ConfigDict
from pydantic.dataclasses import dataclass

from muscle_bayes.data.describing.elements import as_tuple
from muscle_bayes.data.describing.sizes import Finite, NonNegative, Positive
from muscle_bayes.twin.plant.parameters import Truth

ElementKind = Literal["muscle", "spring", "none"]
CHECKED = ConfigDict(strict=True)
"""Of the tables below: a value that cannot be is an error, told by pydantic."""


def _rising(ends: tuple[float, float]) -> tuple[float, float]:
    if not ends[0] < ends[1]:
        raise ValueError("must be [lower, upper]")
    return ends


def _not_zero(value: float) -> float:
    if value == 0.0:
        raise ValueError("must not be zero")
    return value


def _none_if_said(value: Any) -> Any:
    return None if value == "none" else value


Pair = Annotated[tuple[float, float], BeforeValidator(as_tuple)]


@dataclass(frozen=True, kw_only=True, config=CHECKED)
class Fixture:
    """Geometry of eq. 7-10 [m, rad] and the room [C]. Side B's pins mirror side A's."""

    rotor_radius_a: Positive = 0.030
    anchor_x_a: Finite = 0.030
    anchor_y_a: Positive = 0.115
    rotor_radius_b: Positive = 0.030
    anchor_x_b: Finite = 0.030
    anchor_y_b: Positive = 0.115
    disc_radius: Positive = 0.0889
    stops: Annotated[Pair, AfterValidator(_rising)] = (-1.2, 1.2)
    room_temperature: Finite = 25.0


@dataclass(frozen=True, kw_only=True, config=CHECKED)
class Element:
    """What is pinned to one side. Lengths [m] matter for a muscle only."""

    kind: ElementKind = "none"
    base_length: Positive = 0.100
    heater_length: Annotated[NonNegative | None, BeforeValidator(_none_if_said)] = None

    def __post_init__(self) -> None:
        if (self.heater_length or 0.0) > self.base_length:
            raise ValueError("heater_length must lie between 0 and base_length")


@dataclass(frozen=True, kw_only=True, config=CHECKED)
class Heater:
    """Heater tube: dT/dt = full_rate PWM/255 - (T - T_room)/cooling_time.

    4.5 C/s and 48 s stand for a 12 V Kanthal coil around a short glass tube: 90 C after about 17 s
    at full power, back within 1 C of the room after about 200 s. A fan makes the cooling time shorter,
    by a factor.
    """

    full_rate: Positive = 4.5
    cooling_time: Positive = 48.0
    fan: float = 0.4


@dataclass(frozen=True, kw_only=True, config=CHECKED)
class Potentiometer:
    """10-bit angle sensor; zero_reading and radians_per_count as the metadata states them.

    The true zero of a run lies up to zero_spread counts away; count_noise [counts] is electrical.
    """

    zero_reading: float = 512.0
    radians_per_count: Annotated[Finite, AfterValidator(_not_zero)] = 0.0058
    zero_spread: float = 2.0
    count_noise: float = 0.4


@dataclass(frozen=True, kw_only=True, config=CHECKED)
class Meter:
    """TMD-56 thermocouple meter: noise and resolution [C], time between updates [s]."""

    noise: float = 0.05
    resolution: Positive = 0.1
    period: Positive = 0.4
    period_jitter: float = 0.02


@dataclass(frozen=True, kw_only=True, config=CHECKED)
class Logger:
    """When rows are written: the protocol sets the aimed period, jitter is relative to it.

    A pause (garbage collection, disc, a busy host) strikes a row with pause_probability.
    """

    jitter: float = 0.12
    pause_probability: float = 0.001
    pause: Pair = (0.1, 0.5)


@dataclass(frozen=True, kw_only=True, config=CHECKED)
class Rig:
    """A complete bench."""

    fixture: Fixture = field(default_factory=Fixture)
    element_a: Element = field(default_factory=lambda: Element(kind="muscle"))
    element_b: Element = field(default_factory=Element)
    truth: Truth = field(default_factory=Truth)
    heater: Heater = field(default_factory=Heater)
    potentiometer: Potentiometer = field(default_factory=Potentiometer)
    meter: Meter = field(default_factory=Meter)
    logger: Logger = field(default_factory=Logger)
    slip_step: Positive = 5e-4
    """Longest time step while the rotor slips, s."""
