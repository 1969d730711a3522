"""Other people's rigs, simulated: small plants, each with its log, its metadata and the truth."""

from benchmarks.rigs.example import Example
from benchmarks.rigs.kinds import EXAMPLES, example

__all__ = ["EXAMPLES", "Example", "example"]
