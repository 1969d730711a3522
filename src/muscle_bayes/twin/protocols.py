"""Test protocols: stages of heater setpoints and load changes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from muscle_bayes.data.describing.sizes import check_mass
from muscle_bayes.errors import MuscleBayesError

ProtocolName = Literal["spring", "staircase", "sawtooth", "free"]

HOT = 90.0
"""Highest setpoint of staircase and sawtooth, C."""
SETPOINTS = (32.0, 40.0, 48.0, 56.0, 64.0, 72.0, 80.0, 85.0, HOT)
"""Of a staircase, C."""
THESIS_MASSES = (0.139, 0.166, 0.212)
"""Test loads of the muscle tests, kg."""
TRAINING_LOAD = 0.060
"""kg"""


@dataclass(frozen=True, kw_only=True)
class Stage:
    """Setpoints [C, None = heater off], held until heated channels are stable or for a duration.

    Heating is over when the setpoint is reached, cooling when the tube is back within 1 C of it,
    both for more than 10 s; then `wait` more seconds pass, so that the log shows it stable. `load`
    [kg] changes at the stage's start, at once or, poured, over `pour_time` seconds.
    """

    setpoint_a: float | None = None
    setpoint_b: float | None = None
    duration: float | None = None
    wait: float = 1.0
    load: float | None = None
    pour_time: float = 0.0
    logged: bool = True

    def __post_init__(self) -> None:
        if self.duration is None and self.setpoint_a is None and self.setpoint_b is None:
            raise MuscleBayesError("a stage needs a setpoint or a duration, this one has neither")
        for what, value in (("duration", self.duration), ("load", self.load)):
            if value is not None and value < 0:
                raise MuscleBayesError(f"a stage's {what} cannot be negative, this one is {value}")
        _check_load(self.load or 0.0)


def _check_load(load: float) -> None:
    """Raises MuscleBayesError where a load [kg] is one of grams."""
    try:
        check_mass(load)
    except ValueError as error:
        raise MuscleBayesError(f"a load{error}") from None


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """A run: its stages, and the state in which it starts.

    load [kg] hangs from the start. initial_angle [rad]: the rotor is held there and released; None
    starts it where it is in equilibrium. initial_hyst is sigma_hyst of the muscles. rest_time [s]:
    the run ends after that long at rest.
    """

    name: ProtocolName
    stages: tuple[Stage, ...]
    load: float
    initial_angle: float | None = None
    initial_hyst: float = 0.02
    log_period: float = 0.03
    rest_time: float | None = None

    def __post_init__(self) -> None:
        _check_load(self.load)


def spring(mass: float) -> Protocol:
    """Reference spring on side A, a weight on the disc, released at theta = 0 at the first row."""
    return Protocol(
        name="spring",
        stages=(Stage(duration=12.0),),
        load=mass,
        initial_angle=0.0,
        rest_time=4.0,
    )


def _training(room: float, mass: float) -> tuple[Stage, ...]:
    """Two unlogged cycles at TRAINING_LOAD, which restore the muscle's short length.

    Then a mass [kg] is poured on, and the log begins.
    """
    hot, cool = Stage(setpoint_a=HOT, logged=False), Stage(setpoint_a=room, logged=False)
    return (
        replace(hot, load=TRAINING_LOAD),
        *(cool, hot, cool),
        Stage(setpoint_a=room, duration=30.0, load=mass, pour_time=2.0, logged=False),
        Stage(setpoint_a=room, duration=10.0),
    )


def staircase(mass: float, *, room: float = 25.0, cycles: int = 3) -> Protocol:
    """Training, then steps up to 90 C and a return to room temperature, repeated."""
    climb = tuple(Stage(setpoint_a=setpoint) for setpoint in SETPOINTS)
    return Protocol(
        name="staircase",
        stages=(*_training(room, mass), *((*climb, Stage(setpoint_a=room)) * cycles)),
        load=TRAINING_LOAD,
    )


def sawtooth(
    masses: Sequence[float] = THESIS_MASSES, *, room: float = 25.0, cycles: int = 2
) -> Protocol:
    """Training, then fast cycles to 90 C; the load grows between cycles, at room temperature."""
    first, *others = masses
    cycle = (Stage(setpoint_a=HOT), Stage(setpoint_a=room, wait=60.0))
    stages = [*_training(room, first), *(cycle * cycles)]
    for mass in others:
        stages.append(Stage(setpoint_a=room, duration=20.0, load=mass, pour_time=4.0))
        stages.extend(cycle * cycles)
    return Protocol(name="sawtooth", stages=tuple(stages), load=TRAINING_LOAD)


def free(
    stages: Sequence[Stage],
    *,
    load: float = 0.0,
    initial_angle: float | None = None,
    initial_hyst: float = 0.02,
    log_period: float = 0.03,
) -> Protocol:
    """Any sequence."""
    return Protocol(
        name="free",
        stages=tuple(stages),
        load=load,
        initial_angle=initial_angle,
        initial_hyst=initial_hyst,
        log_period=log_period,
    )
