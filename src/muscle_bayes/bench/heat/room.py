"""The meter's first readings against the room: before any heat, they have to agree."""

from typing import Final

from muscle_bayes.bench.meters.meter import Reading
from muscle_bayes.errors import MuscleBayesError

NEAR: Final = 10.0
"""A cold tube shows its room's temperature to within this, C; rooms are seldom known better."""
_NEAR_IN_FAHRENHEIT: Final = 6.0


def far_from_room(reading: Reading, room: float) -> str:
    """What the operator has to confirm before heat is given to tubes in a room [C]; empty if nothing.

    Raises MuscleBayesError where the meter shows Fahrenheit.
    """
    shown = {
        name: value
        for name, value in zip(("T1", "T2"), reading.temperatures, strict=True)
        if value is not None
    }
    if all(abs(value - room) <= NEAR for value in shown.values()):
        return ""
    told = " and ".join(f"{name} {value:.1f}" for name, value in shown.items())
    if all(abs((value - 32.0) / 1.8 - room) <= _NEAR_IN_FAHRENHEIT for value in shown.values()):
        raise MuscleBayesError(
            f"the meter shows {told}: that is a room of {room:g} C in Fahrenheit. Fix: set the "
            "meter to C. If the tubes really are that warm, wait until they have cooled."
        )
    return f"The meter shows {told} C, and the room has {room:g} C"
