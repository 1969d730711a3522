"""The simulated bench: fixture, elements, heaters, sensors and what is true of them."""

from dataclasses import dataclass, field
from typing import Literal

from muscle_bayes.twin.checks import check_rig
from muscle_bayes.twin.plant.parameters import Truth

ElementKind = Literal["muscle", "spring", "none"]


@dataclass(frozen=True, kw_only=True)
class Fixture:
    """Geometry of eq. 7-10 [m, rad] and the room [C]. Side B's pins mirror side A's."""

    rotor_radius_a: float = 0.030
    anchor_x_a: float = 0.030
    anchor_y_a: float = 0.115
    rotor_radius_b: float = 0.030
    anchor_x_b: float = 0.030
    anchor_y_b: float = 0.115
    disc_radius: float = 0.0889
    stops: tuple[float, float] = (-1.2, 1.2)
    room_temperature: float = 25.0


@dataclass(frozen=True, kw_only=True)
class Element:
    """What is pinned to one side. Lengths [m] matter for a muscle only."""

    kind: ElementKind = "none"
    base_length: float = 0.100
    heater_length: float | None = None


@dataclass(frozen=True, kw_only=True)
class Heater:
    """Heater tube: dT/dt = full_rate PWM/255 - (T - T_room)/cooling_time.

    4.5 C/s and 48 s stand for a 12 V Kanthal coil around a short glass tube: 90 C after about 17 s
    at full power, back within 1 C of the room after about 200 s. A fan makes the cooling time shorter,
    by a factor.
    """

    full_rate: float = 4.5
    cooling_time: float = 48.0
    fan: float = 0.4


@dataclass(frozen=True, kw_only=True)
class Potentiometer:
    """10-bit angle sensor; zero_reading and radians_per_count as the metadata states them.

    The true zero of a run lies up to zero_spread counts away; count_noise [counts] is electrical.
    """

    zero_reading: float = 512.0
    radians_per_count: float = 0.0058
    zero_spread: float = 2.0
    count_noise: float = 0.4


@dataclass(frozen=True, kw_only=True)
class Meter:
    """TMD-56 thermocouple meter: noise and resolution [C], time between updates [s]."""

    noise: float = 0.05
    resolution: float = 0.1
    period: float = 0.4
    period_jitter: float = 0.02


@dataclass(frozen=True, kw_only=True)
class Logger:
    """When rows are written: the protocol sets the aimed period, jitter is relative to it.

    A pause (garbage collection, disc, a busy host) strikes a row with pause_probability.
    """

    jitter: float = 0.12
    pause_probability: float = 0.001
    pause: tuple[float, float] = (0.1, 0.5)


@dataclass(frozen=True, kw_only=True)
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
    slip_step: float = 5e-4
    """Longest time step while the rotor slips, s."""

    def __post_init__(self) -> None:
        check_rig(self)
