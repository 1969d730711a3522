"""The catalogue of effects: one line each, one file each."""

from muscle_bayes.errors import MuscleBayesError, did_you_mean
from muscle_bayes.physics.effect import CourseFilter, Effect
from muscle_bayes.physics.effects.empirical import PREFIX, empirical_type
from muscle_bayes.physics.effects.muscle.coil_contact import CoilContact
from muscle_bayes.physics.effects.muscle.damper_law import DamperLaw
from muscle_bayes.physics.effects.muscle.first_cycle_set import FirstCycleSet
from muscle_bayes.physics.effects.muscle.hysteresis_yield import HysteresisYield
from muscle_bayes.physics.effects.muscle.modulus_temperature import ModulusTemperature
from muscle_bayes.physics.effects.muscle.second_relaxation import SecondRelaxation
from muscle_bayes.physics.effects.muscle.slack import Slack
from muscle_bayes.physics.effects.own import FILES, AnyEffectType, own_effects
from muscle_bayes.physics.effects.rotor.bias_torque import BiasTorque
from muscle_bayes.physics.effects.rotor.cogging import Cogging
from muscle_bayes.physics.effects.rotor.force_scale import ForceScale
from muscle_bayes.physics.effects.rotor.load_dependent_friction import LoadDependentFriction
from muscle_bayes.physics.effects.rotor.position_dependent_friction import PositionDependentFriction
from muscle_bayes.physics.effects.rotor.quadratic_drag import QuadraticDrag
from muscle_bayes.physics.effects.rotor.stribeck_friction import StribeckFriction
from muscle_bayes.physics.effects.rotor.viscous_friction import ViscousFriction
from muscle_bayes.physics.effects.sensing.backlash import Backlash
from muscle_bayes.physics.effects.sensing.clock_offset import ClockOffset
from muscle_bayes.physics.effects.sensing.partial_heating import PartialHeating
from muscle_bayes.physics.effects.sensing.potentiometer_nonlinearity import (
    PotentiometerNonlinearity,
)
from muscle_bayes.physics.effects.sensing.thermal_lag import ThermalLag
from muscle_bayes.physics.effects.sensing.zero_drift import ZeroDrift

AnyEffect = Effect | CourseFilter

CATALOGUE: dict[str, AnyEffectType] = {
    effect.name: effect
    for effect in (
        Backlash,
        BiasTorque,
        ClockOffset,
        Cogging,
        CoilContact,
        DamperLaw,
        FirstCycleSet,
        ForceScale,
        HysteresisYield,
        LoadDependentFriction,
        ModulusTemperature,
        PartialHeating,
        PositionDependentFriction,
        PotentiometerNonlinearity,
        QuadraticDrag,
        SecondRelaxation,
        Slack,
        StribeckFriction,
        ThermalLag,
        ViscousFriction,
        ZeroDrift,
    )
}


def effect_type(name: str) -> AnyEffectType:
    """The effect of that name: of the catalogue, a function, or of the user's own.

    Raises MuscleBayesError when there is none, or one of your own has a name of the catalogue.
    """
    if name.startswith(f"{PREFIX}-"):
        return empirical_type(name)
    own = own_effects()
    if name in CATALOGUE:
        if own.get(name, CATALOGUE[name]) is not CATALOGUE[name]:
            raise MuscleBayesError(
                f"effect {name!r}: one of your own has the name of one of the catalogue. Fix: give "
                "it another name."
            )
        return CATALOGUE[name]
    if name not in own:
        known = sorted({**CATALOGUE, **own})
        raise MuscleBayesError(
            f"effect {name!r} is not in the catalogue.{did_you_mean(name, known)} Fix: choose from "
            f"{', '.join(known)}; for one of your own, name its file in the environment variable "
            f"{FILES}."
        )
    return own[name]


__all__ = [
    "CATALOGUE",
    "AnyEffect",
    "AnyEffectType",
    "Backlash",
    "BiasTorque",
    "ClockOffset",
    "Cogging",
    "CoilContact",
    "DamperLaw",
    "FirstCycleSet",
    "ForceScale",
    "HysteresisYield",
    "LoadDependentFriction",
    "ModulusTemperature",
    "PartialHeating",
    "PositionDependentFriction",
    "PotentiometerNonlinearity",
    "QuadraticDrag",
    "SecondRelaxation",
    "Slack",
    "StribeckFriction",
    "ThermalLag",
    "ViscousFriction",
    "ZeroDrift",
    "effect_type",
]
