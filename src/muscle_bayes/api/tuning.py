"""Tuning a joint's gains over new muscles, with progress."""

from collections.abc import Mapping, Sequence

import numpy as np

from muscle_bayes.control.laws.gains import LawName
from muscle_bayes.control.laws.templates import TUNED
from muscle_bayes.control.plant.design import Design
from muscle_bayes.control.plant.draws import joint_draws
from muscle_bayes.control.plant.heater_fit import assumed_heater
from muscle_bayes.control.scenarios.scenario import Scenario
from muscle_bayes.control.scenarios.thesis import thesis_scenarios
from muscle_bayes.control.study import TunedLaws, tuned_laws
from muscle_bayes.control.tune import Effort as TuningEffort
from muscle_bayes.errors import refuse_all_but
from muscle_bayes.inference.population import Population, fit_population
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.progress import shown_progress


def tune(
    muscle: Posterior | Population,
    *,
    fixture: Posterior | None = None,
    heater: Mapping[str, np.ndarray] | None = None,
    design: Design | None = None,
    scenarios: Sequence[Scenario] | None = None,
    limits: Mapping[str, float] | None = None,
    laws: Sequence[LawName] = TUNED,
    draws: int = 96,
    judged: int = 400,
    effort: TuningEffort | None = None,
    seed: int = 0,
    progress: bool = True,
) -> TunedLaws:
    """Gains of an antagonistic joint for muscles that have not been built yet.

    Args:
        muscle: a population, or the posterior of one muscle: then the spread is assumed.
        fixture: posterior whose J, D and friction the joint has; default: those of `muscle`.
        heater: draws of the heater's gain [K/s at full duty], cooling [1/s] and lag [s], as
            `muscle_bayes.control.plant.heater_fit.fit_heater` gives them; default: assumed ones.
        design: the joint's geometry and sensors; default: the bench's.
        scenarios: what the joint has to do; default: the nine of the thesis.
        limits: largest values of metrics (SI) that replace the default specifications.
        laws: the control laws; the thesis' is judged beside them.
        draws: joints to tune on.
        judged: other joints, to judge on.
        effort: how hard to look.
        seed: of the random numbers.
        progress: whether to show stages and the time to go.

    Returns:
        The laws judged on new joints, with a recommendation.

    Raises:
        MuscleBayesError: where the posterior has no muscle.

    Example:
        >>> import muscle_bayes as mb
        >>> from muscle_bayes.control.scenarios.thesis import thesis_scenarios
        >>> from muscle_bayes.control.tune import Effort
        >>> muscle = mb.load("muscle.nc")  # of the staircases, by `fit`
        >>> few = Effort(starts=2, scouts=2, kept=1, rounds=0)
        >>> step = thesis_scenarios()[:1]
        >>> tuned = mb.tune(
        ...     muscle, laws=["pi"], scenarios=step, draws=4, judged=4, effort=few, progress=False
        ... )
        >>> sorted(tuned.judgement.gains)
        ['pi', 'thesis']
    """
    if not isinstance(muscle, Population):
        refuse_all_but(Posterior, muscle, "muscle", "give one that `fit` or `load` returns")
    population = muscle if isinstance(muscle, Population) else fit_population({"m1": muscle})
    tubes = assumed_heater(seed).draws if heater is None else heater
    joints = joint_draws(
        population, tubes, draws + judged, design=design, fixture=fixture, seed=seed
    )
    with shown_progress(progress) as report:
        return tuned_laws(
            joints,
            draws,
            thesis_scenarios() if scenarios is None else scenarios,
            laws=laws,
            limits=limits,
            effort=effort,
            seed=seed,
            report=report,
        )
