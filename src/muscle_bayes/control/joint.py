"""The antagonistic joint: two muscles on one rotor, each in its heater tube, seen by sensors."""

from typing import Any

import equinox as eqx

from muscle_bayes.control.heater import Heater
from muscle_bayes.control.sensors import Potentiometer, Thermocouples
from muscle_bayes.physics.plant import Plant


class Joint(eqx.Module):
    """A joint with all its parameters known: one draw.

    `plant` has a muscle on both sides; they share their parameters and effects, and have
    temperatures and HYST strains of their own.
    """

    plant: Plant
    heater: Heater
    potentiometer: Potentiometer
    thermocouples: Thermocouples

    def counts_of(self, angle: Any) -> Any:
        """Setpoint [counts, not rounded] for an angle [rad]."""
        return self.potentiometer.counts(angle)
