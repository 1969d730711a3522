"""What acts between rotor and stator on one side: one file each."""

from muscle_bayes.physics.elements.arm import Arm
from muscle_bayes.physics.elements.element import Element, Instant, through_port
from muscle_bayes.physics.elements.muscle import Muscle
from muscle_bayes.physics.elements.nothing import NoElement
from muscle_bayes.physics.elements.reference_spring import ReferenceSpring
from muscle_bayes.physics.elements.spring import Spring
from muscle_bayes.physics.elements.torsion_spring import TorsionSpring

__all__ = [
    "Arm",
    "Element",
    "Instant",
    "Muscle",
    "NoElement",
    "ReferenceSpring",
    "Spring",
    "TorsionSpring",
    "through_port",
]
