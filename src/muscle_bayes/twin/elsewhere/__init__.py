"""Other people's rigs, simulated: small plants, each with its log, its metadata and the truth."""

from muscle_bayes.twin.elsewhere.example import Example
from muscle_bayes.twin.elsewhere.kinds import EXAMPLES, example

__all__ = ["EXAMPLES", "Example", "example"]
