"""The bench's twin: an independent simulator that writes synthetic runs with a known truth.

It shares neither model nor integration code with the inference, so that an error in one shows as a
misfit instead of cancelling.
"""

from muscle_bayes.twin.effects import EFFECTS, Effect, make_effect, parse_effect
from muscle_bayes.twin.plant.parameters import (
    COULOMB_TABLE_1,
    LINEAR_TABLE_1,
    MuscleParameters,
    Truth,
)
from muscle_bayes.twin.plant.rig import (
    Element,
    Fixture,
    Heater,
    Logger,
    Meter,
    Potentiometer,
    Rig,
)
from muscle_bayes.twin.plant.swings import spring_masses, spring_rig
from muscle_bayes.twin.protocols import Protocol, Stage, free, sawtooth, spring, staircase
from muscle_bayes.twin.simulate import SimulatedRun, simulate
from muscle_bayes.twin.storage import save_runs

__all__ = [
    "COULOMB_TABLE_1",
    "EFFECTS",
    "LINEAR_TABLE_1",
    "Effect",
    "Element",
    "Fixture",
    "Heater",
    "Logger",
    "Meter",
    "MuscleParameters",
    "Potentiometer",
    "Protocol",
    "Rig",
    "SimulatedRun",
    "Stage",
    "Truth",
    "free",
    "make_effect",
    "parse_effect",
    "save_runs",
    "sawtooth",
    "simulate",
    "spring",
    "spring_masses",
    "spring_rig",
    "staircase",
]
