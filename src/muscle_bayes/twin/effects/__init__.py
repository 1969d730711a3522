"""Effects that a twin can hide from the inference, by name."""

from dataclasses import fields

from muscle_bayes.errors import MuscleBayesError, did_you_mean
from muscle_bayes.twin.effects import creep, muscle, rotor, sensing
from muscle_bayes.twin.effects.base import Effect

EFFECTS: dict[str, type[Effect]] = {
    kind.name: kind
    for kind in (
        sensing.Backlash,
        rotor.BiasTorque,
        sensing.ClockOffset,
        rotor.Cogging,
        muscle.CoilContact,
        muscle.DamperLaw,
        creep.FirstCycleSet,
        rotor.ForceScale,
        muscle.HysteresisYield,
        rotor.LoadDependentFriction,
        muscle.ModulusTemperature,
        sensing.PartialHeating,
        rotor.PositionDependentFriction,
        sensing.PotentiometerNonlinearity,
        rotor.QuadraticDrag,
        creep.SecondRelaxation,
        muscle.Slack,
        rotor.StribeckFriction,
        sensing.ThermalLag,
        rotor.ViscousFriction,
        sensing.ZeroDrift,
    )
}


def make_effect(name: str, **values: float) -> Effect:
    """Effect of that name with those parameters."""
    if name not in EFFECTS:
        raise MuscleBayesError(
            f"unknown effect {name!r}.{did_you_mean(name, EFFECTS)} Fix: choose one of "
            f"{', '.join(sorted(EFFECTS))}."
        )
    kind = EFFECTS[name]
    known = [field.name for field in fields(kind)]
    for key in values:
        if key not in known:
            raise MuscleBayesError(
                f"effect {name!r} has no parameter {key!r}.{did_you_mean(key, known)} Fix: choose one of "
                f"{', '.join(known)}."
            )
    return kind(**values)


def parse_effect(text: str) -> Effect:
    """Effect from NAME or NAME:param=value,param=value."""
    name, _, rest = text.partition(":")
    values: dict[str, float] = {}
    for item in filter(None, rest.split(",")):
        key, separator, value = item.partition("=")
        try:
            values[key.strip()] = float(value)
        except ValueError:
            separator = ""
        if not separator:
            raise MuscleBayesError(
                f"effect {text!r}: {item!r} is not param=value. Fix: give a number for value."
            )
    return make_effect(name.strip(), **values)


__all__ = ["EFFECTS", "Effect", "make_effect", "parse_effect"]
