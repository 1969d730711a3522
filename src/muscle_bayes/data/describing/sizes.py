"""Numbers of a run's metadata, and those that no rig has: then another unit is likely meant."""

from collections.abc import Callable
from typing import Annotated, Final

from pydantic import AfterValidator, Field

LARGEST_RADIUS: Final = 1.0
"""m, of rotors, discs and drums; more are taken for another unit."""
LONGEST: Final = 10.0
"""m, of elements."""
MOST_LOAD: Final = 20.0
"""kg that a load may have; more are taken for grams."""
ROOM: Final = (-30.0, 50.0)
"""C; warmer rooms are taken for Fahrenheit, or kelvin."""


def _measurable(value: float) -> float:
    """The value. Raises ValueError where it is too small, and not 0, for its square to be a number."""
    if 0.0 < abs(value) < 1e-30:
        raise ValueError(f": {value:g} is no measurement in any unit; correct it, or write 0")
    return value


def _at_most(most: float, what: str, unit: str, smaller: str) -> Callable[[float], float]:
    """A check, which raises ValueError: a thousandth is meant of what is larger."""

    def checked(value: float) -> float:
        if value > most:
            raise ValueError(
                f": {value:g} {unit} are more than {most:g} {unit}; {what} are in {unit}: write "
                f"{value / 1000:g} if {value:g} {smaller} are meant"
            )
        return value

    return checked


check_mass = _at_most(MOST_LOAD, "masses", "kg", "g")
"""The mass of a load [kg]; kg everywhere, and no tonne hangs by mistake for a kilogram."""


def _in_a_room(value: float) -> float:
    if not ROOM[0] <= value <= ROOM[1]:
        others = {"F": (value - 32.0) / 1.8, "K": value - 273.15}
        likely = [unit for unit, celsius in others.items() if 0.0 <= celsius <= ROOM[1]]
        meant = "".join(
            f": write {others[unit]:.3g} if {value:g} {unit} are meant" for unit in likely
        )
        raise ValueError(f": no room has {value:g} C; room temperatures are in C{meant}")
    return value


# Beyond 1e30 no number is a measurement in any unit, and sums of squares overflow.
Finite = Annotated[
    float, Field(ge=-1e30, le=1e30, allow_inf_nan=False), AfterValidator(_measurable)
]
Positive = Annotated[float, Field(gt=0, le=1e30, allow_inf_nan=False), AfterValidator(_measurable)]
NonNegative = Annotated[
    float, Field(ge=0, le=1e30, allow_inf_nan=False), AfterValidator(_measurable)
]
Radius = Annotated[Positive, AfterValidator(_at_most(LARGEST_RADIUS, "lengths", "m", "mm"))]
Length = Annotated[Positive, AfterValidator(_at_most(LONGEST, "lengths", "m", "mm"))]
RoomTemperature = Annotated[Finite, AfterValidator(_in_a_room)]
Mass = Annotated[float, Field(ge=0, allow_inf_nan=False), AfterValidator(check_mass)]
