"""Every specimen fitted on its own, from runs whose metadata name it."""

from collections.abc import Callable, Mapping, Sequence

from muscle_bayes.data.run import Run
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.sampling.fit import QUICK, fit
from muscle_bayes.inference.sampling.sampler import Effort


def by_specimen(runs: Sequence[Run]) -> dict[str, list[Run]]:
    """Runs by the specimen that their metadata name.

    Raises MuscleBayesError where one names none.
    """
    found: dict[str, list[Run]] = {}
    for run in runs:
        name = getattr(run.metadata.element_a, "specimen", None)
        if name is None:
            raise MuscleBayesError(
                f'{run.name}: names no specimen. Fix: add specimen = "NAME" under [element_a] of its '
                "metadata, or give posteriors"
            )
        found.setdefault(name, []).append(run)
    return found


def fit_specimens(
    runs: Mapping[str, Sequence[Run]],
    *,
    given: Posterior | None = None,
    effort: Effort = QUICK,
    seed: int = 0,
    report: Callable[[str, int, int], None] = lambda stage, done, total: None,
) -> dict[str, Posterior]:
    """The posterior of each specimen's runs; the report's stages name the specimen."""

    def of(name: str) -> Callable[[str, int, int], None]:
        return lambda stage, done, total: report(f"{name}: {stage}", done, total)

    return {
        name: fit(own, effort=effort, given=given, seed=seed + number, report=of(name))
        for number, (name, own) in enumerate(runs.items())
    }
