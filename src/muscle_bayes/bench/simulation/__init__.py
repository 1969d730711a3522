"""The bench without hardware: the real firmware in simavr, the twin as plant, one virtual clock."""

from muscle_bayes.bench.simulation.bench import SimulatedBench
from muscle_bayes.bench.simulation.plant import TwinPlant

__all__ = ["SimulatedBench", "TwinPlant"]
