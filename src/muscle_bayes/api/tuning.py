"""Tuning a joint's gains from a posterior, with progress."""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from muscle_bayes.control.batch import Bank
from muscle_bayes.control.closed_loop import Clock
from muscle_bayes.control.criteria import Criterion, CVaR
from muscle_bayes.control.design import Design
from muscle_bayes.control.draws import joint_draws
from muscle_bayes.control.gains import Gains
from muscle_bayes.control.heater_fit import assumed_heater
from muscle_bayes.control.scenario import Scenario
from muscle_bayes.control.scenarios import thesis_scenarios
from muscle_bayes.control.tune import Effort as TuningEffort
from muscle_bayes.control.tune import Tuning
from muscle_bayes.control.tune import tune as tune_bank
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.progress import shown_progress


def tune(
    posterior: Posterior,
    *,
    fixture: Posterior | None = None,
    heater: Mapping[str, np.ndarray] | None = None,
    design: Design | None = None,
    scenarios: Sequence[Scenario] | None = None,
    criterion: Criterion | None = None,
    law: Literal["pi", "pi-antiwindup", "cascade"] = "pi-antiwindup",
    draws: int = 64,
    effort: TuningEffort | None = None,
    seed: int = 0,
    progress: bool = True,
) -> Tuning:
    """Gains of an antagonistic joint that serve all the muscles that a posterior allows.

    Args:
        posterior: of runs with a muscle.
        fixture: posterior whose J, D and friction the joint has; default: those of `posterior`.
        heater: draws of the heater's gain [K/s at full duty], cooling [1/s] and lag [s], as
            `muscle_bayes.control.heater_fit.fit_heater` gives them; default: assumed ones.
        design: the joint's geometry and sensors; default: the bench's.
        scenarios: what the joint has to do; default: the nine of the thesis.
        criterion: what is made small; default: `CVaR()`, the mean of the worst 5 % of costs.
        law: the control law.
        draws: joints to tune on.
        effort: how hard to look.
        seed: of the random numbers.
        progress: whether to show stages and the time to go.

    Returns:
        The gains [duty/rad, duty/(rad s), duty], the criterion's value and how they came about.

    Raises:
        MuscleBayesError: where the posterior has no muscle.

    Example:
        >>> import muscle_bayes as mb
        >>> from muscle_bayes.control.tune import Effort
        >>> muscle = mb.load("muscle.nc")  # of the staircases, by `fit`
        >>> few = Effort(starts=2, scout_draws=2, refined=1, steps=1)
        >>> tuning = mb.tune(muscle, draws=4, effort=few, progress=False)
        >>> tuning.gains.law
        'pi-antiwindup'
    """
    tubes = assumed_heater(seed).draws if heater is None else heater
    joints = joint_draws(posterior, tubes, draws, design=design, fixture=fixture, seed=seed)
    start = Gains(law=law, proportional=1.0, integral=1.0)
    with shown_progress(progress) as report:
        return tune_bank(
            Bank(joints, Clock(start.period), seed),
            thesis_scenarios(start.period) if scenarios is None else scenarios,
            CVaR() if criterion is None else criterion,
            start,
            effort=effort,
            seed=seed,
            report=report,
        )
