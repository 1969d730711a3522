"""What makes a rig impossible, told before it is simulated."""

from math import isfinite
from typing import TYPE_CHECKING

from muscle_bayes.errors import MuscleBayesError

if TYPE_CHECKING:
    from muscle_bayes.twin.plant.rig import Rig


def check_rig(rig: "Rig") -> None:
    """Raise MuscleBayesError where a value cannot be."""
    truth, fixture = rig.truth, rig.fixture
    positive = {
        "truth.J": truth.J,
        "fixture.disc_radius": fixture.disc_radius,
        "heater.cooling_time": rig.heater.cooling_time,
        "heater.full_rate": rig.heater.full_rate,
        "meter.period": rig.meter.period,
        "meter.resolution": rig.meter.resolution,
        "slip_step": rig.slip_step,
    }
    positive |= {
        f"fixture.{pin}_{side}": getattr(fixture, f"{pin}_{side}")
        for side in "ab"
        for pin in ("rotor_radius", "anchor_y")
    }
    for side in "ab":
        element, muscle = getattr(rig, f"element_{side}"), getattr(truth, f"muscle_{side}")
        positive[f"element_{side}.base_length"] = element.base_length
        for key in ("epsilon", "K_hyst", "K_modulus"):
            positive[f"truth.muscle_{side}.{key}"] = getattr(muscle, key)
        heated = element.heater_length
        if heated is not None and not 0.0 <= heated <= element.base_length:
            raise MuscleBayesError(
                f"element_{side}.heater_length: {heated} m must lie between 0 and base_length"
            )
    for name, value in positive.items():
        if not (value > 0.0 and isfinite(value)):
            raise MuscleBayesError(f"{name}: {value} must be positive and finite")
    if not truth.D >= 0.0:
        raise MuscleBayesError(f"truth.D: {truth.D} must not be negative")
    if rig.potentiometer.radians_per_count == 0.0:
        raise MuscleBayesError("potentiometer.radians_per_count: must not be zero")
    if not fixture.stops[0] < fixture.stops[1]:
        raise MuscleBayesError(f"fixture.stops: {fixture.stops} must be [lower, upper]")
