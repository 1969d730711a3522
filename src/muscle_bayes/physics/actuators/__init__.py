"""What turns a logged drive into a force on the coordinate: one file each."""

from muscle_bayes.physics.actuators.actuator import Actuator
from muscle_bayes.physics.actuators.current_drive import CurrentDrive
from muscle_bayes.physics.actuators.known_force import KnownForce
from muscle_bayes.physics.actuators.scaled_force import ScaledForce
from muscle_bayes.physics.actuators.voltage_drive import VoltageDrive

__all__ = ["Actuator", "CurrentDrive", "KnownForce", "ScaledForce", "VoltageDrive"]
