"""Fitting runs from Python, with progress."""

from collections.abc import Mapping, Sequence

from numpyro import distributions as dist

from muscle_bayes.conventions import Friction
from muscle_bayes.data.run import Run
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.sampling import fit as fitting
from muscle_bayes.inference.sampling.sampler import Effort
from muscle_bayes.physics.effects.own import AnyEffectType
from muscle_bayes.progress import shown_progress


def fit(
    runs: Sequence[Run],
    friction: Friction = "coulomb",
    effects: Sequence[str | AnyEffectType] = (),
    *,
    effort: Effort | str = "full",
    given: Posterior | None = None,
    priors: Mapping[str, dist.Distribution] | None = None,
    seed: int = 0,
    progress: bool = True,
) -> Posterior:
    """Posterior of everything that is unknown about these runs.

    Which parameters are estimated follows from the runs: J and D always, the muscle's nine where a
    run has a muscle, each effect's own. Each run's zero and first position, and the noise, are
    sampled along.

    Args:
        runs: as `read_runs` gives them.
        friction: "coulomb": dry friction that sticks, D in N m or N. "linear": friction
            proportional to speed, D in N m s or N s/m.
        effects: names of effects, or classes of your own, in the order in which they act.
        effort: "quick" (some 200 effective draws), "full", or an `Effort` with numbers of its own.
        given: an earlier posterior of the fixture: its J and D become this fit's prior.
        priors: distributions that replace the default ones, by the name of a site or of a
            parameter of Table 2; `calibration_model` prints them.
        seed: of the random numbers; the same seed gives the same draws.
        progress: whether to show stages, draws and the time to go.

    Returns:
        The posterior in SI units; `tree` is an ArviZ DataTree. If `converged` is false its numbers
        are not to be used, and `complaints` says why.

    Raises:
        MuscleBayesError: for runs that cannot be fitted together or simulated, for unknown friction,
            effects, priors and efforts, and where `given` has another friction.

    Example:
        >>> import muscle_bayes as mb
        >>> posterior = mb.fit(mb.load_example("springs"), effort="quick", progress=False)
        >>> posterior.parameters
        ('J', 'D')
        >>> posterior.tree["posterior"]["J"].attrs["units"]
        'kg m^2'
    """
    if not isinstance(effort, Effort):
        if effort not in fitting.EFFORTS:
            raise MuscleBayesError(
                f"there is no effort {effort!r}. Fix: choose one of {', '.join(fitting.EFFORTS)}."
            )
        effort = fitting.EFFORTS[effort]
    with shown_progress(progress) as report:
        return fitting.fit(
            runs,
            friction,
            effects,
            effort=effort,
            given=given,
            priors=priors,
            seed=seed,
            report=report,
        )
