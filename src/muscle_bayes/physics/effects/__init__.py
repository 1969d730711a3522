"""The catalogue of effects: one line each, one file each."""

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.physics.effect import Effect, TemperatureFilter
from muscle_bayes.physics.effects.bias_torque import BiasTorque
from muscle_bayes.physics.effects.coil_contact import CoilContact
from muscle_bayes.physics.effects.empirical import PREFIX, empirical_type
from muscle_bayes.physics.effects.thermal_lag import ThermalLag
from muscle_bayes.physics.effects.viscous_friction import ViscousFriction

AnyEffect = Effect | TemperatureFilter

CATALOGUE: dict[str, type[Effect] | type[TemperatureFilter]] = {
    effect.name: effect for effect in (ViscousFriction, BiasTorque, CoilContact, ThermalLag)
}


def effect_type(name: str) -> type[Effect] | type[TemperatureFilter]:
    """The effect of that name. Raises MuscleBayesError when the catalogue has none."""
    if name.startswith(f"{PREFIX}-"):
        return empirical_type(name)
    if name not in CATALOGUE:
        known = ", ".join(sorted(CATALOGUE))
        raise MuscleBayesError(f"effect '{name}' is not in the catalogue; choose from: {known}")
    return CATALOGUE[name]


__all__ = [
    "CATALOGUE",
    "AnyEffect",
    "BiasTorque",
    "CoilContact",
    "ThermalLag",
    "ViscousFriction",
    "effect_type",
]
