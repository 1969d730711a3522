"""A population of muscles from Python, with progress."""

from collections.abc import Mapping, Sequence

from muscle_bayes.data.run import Run
from muscle_bayes.inference import population
from muscle_bayes.inference.population.hierarchy import SPREAD
from muscle_bayes.inference.population.specimens import by_specimen, fit_specimens
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.sampling.fit import QUICK
from muscle_bayes.inference.sampling.sampler import Effort
from muscle_bayes.progress import shown_progress


def fit_population(
    specimens: Mapping[str, Posterior] | Sequence[Run],
    *,
    given: Posterior | None = None,
    spread: float = SPREAD,
    effort: Effort = QUICK,
    seed: int = 0,
    progress: bool = True,
) -> population.Population:
    """The mean and spread of the population that specimens come from.

    Args:
        specimens: posteriors of one muscle each, by name; or runs whose metadata name their specimen
            under [element_a]. Runs are fitted first, specimen after specimen.
        given: a posterior of the fixture, which specimens share; for runs only.
        spread: prior median of the relative spread between specimens. One specimen says nothing of
            it: then the spread is this prior.
        effort: of fits of runs.
        seed: of the random numbers.
        progress: whether to show stages, draws and the time to go.

    Returns:
        The population; `new_muscles(count)` draws muscles that have not been built yet.

    Raises:
        MuscleBayesError: for runs that name no specimen, and posteriors without a muscle.

    Example:
        >>> import muscle_bayes as mb
        >>> population = mb.fit_population({"m1": mb.load("muscle.nc")})  # of `fit`
        >>> population.new_muscles(5)["K_modulus"].shape
        (5,)
    """
    if not isinstance(specimens, Mapping):
        runs = by_specimen(specimens)
        with shown_progress(progress) as report:
            specimens = fit_specimens(runs, given=given, effort=effort, seed=seed, report=report)
    return population.fit_population(specimens, spread=spread, seed=seed)
