"""What a sensor measures of a plant's motion: one file each."""

from muscle_bayes.physics.outputs.output import Output
from muscle_bayes.physics.outputs.position import Position
from muscle_bayes.physics.outputs.temperature import Temperature
from muscle_bayes.physics.outputs.tension import Tension
from muscle_bayes.physics.outputs.velocity import Velocity

__all__ = ["Output", "Position", "Temperature", "Tension", "Velocity"]
