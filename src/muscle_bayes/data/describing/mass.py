"""Masses of loads: kg everywhere, and no tonne hangs by mistake for a kilogram."""

from typing import Annotated, Final

from pydantic import AfterValidator, Field

MOST_LOAD: Final = 20.0
"""kg that a load may have; more are taken for grams."""


def check_mass(mass: float) -> float:
    """The mass [kg]. Raises ValueError where it is beyond MOST_LOAD."""
    if mass > MOST_LOAD:
        raise ValueError(
            f": {mass:g} kg are more than {MOST_LOAD:g} kg; masses are in kg: write "
            f"{mass / 1000:g} if {mass:g} g are meant"
        )
    return mass


Mass = Annotated[float, Field(ge=0, allow_inf_nan=False), AfterValidator(check_mass)]
