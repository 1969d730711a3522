"""The population that specimens come from: what is known of a muscle that has not been built yet."""

from muscle_bayes.inference.population.hierarchy import fit_population
from muscle_bayes.inference.population.loading import load_population
from muscle_bayes.inference.population.population import Population

__all__ = ["Population", "fit_population", "load_population"]
