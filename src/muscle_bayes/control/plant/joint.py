"""The antagonistic joint: two muscles on one rotor, each in its heater tube, seen by sensors."""

import equinox as eqx

from muscle_bayes.control.plant.heater import Heater
from muscle_bayes.control.plant.sensors import Potentiometer, Thermocouples
from muscle_bayes.physics.plant import Plant


class Joint(eqx.Module):
    """A joint with all its parameters known: one draw.

    `plant` has a muscle on both sides, each with parameters, temperature and HYST strain of its own;
    they share the effects.
    """

    plant: Plant
    heater: Heater
    potentiometer: Potentiometer
    thermocouples: Thermocouples
