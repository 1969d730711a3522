"""A population from a file, whichever of the two it holds."""

from pathlib import Path

import xarray as xr

from muscle_bayes.inference.population.hierarchy import fit_population
from muscle_bayes.inference.population.population import Population
from muscle_bayes.inference.posteriors.posterior import Posterior


def load_population(path: Path) -> tuple[Population, list[str]]:
    """The population of a file, and what has to be told of it.

    A posterior stands for one specimen of a population whose spread nobody has measured: it is its prior.
    Raises MuscleBayesError where the file holds neither.
    """
    try:
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            whole = tree.attrs.get("kind") == "population"
    except (OSError, ValueError):
        whole = False
    if whole:
        population = Population.load(path)
        return population, [f"population of {len(population.specimens)} specimens, {path.name}"]
    posterior = Posterior.load(path)
    notes = [f"one specimen, {path.name}; the spread between specimens is assumed, not measured"]
    if not posterior.converged:
        notes.append(f"{path} HAS NOT CONVERGED: {'; '.join(posterior.complaints)}")
    return fit_population({path.stem: posterior}), notes
