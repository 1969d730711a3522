"""What a posterior, or the prior alone, predicts for runs."""

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from muscle_bayes.conventions import Friction
from muscle_bayes.data.run import Run, refuse_unread
from muscle_bayes.errors import MuscleBayesError, refuse_all_but
from muscle_bayes.inference.model.density import unconstrain
from muscle_bayes.inference.model.lane_model import frame_of
from muscle_bayes.inference.model.muscle_prior import MUSCLE_PARAMETERS, TAUT_FORCE, completed
from muscle_bayes.inference.model.prior_draws import prior_draws
from muscle_bayes.inference.model.problem import Problem, pose
from muscle_bayes.inference.model.reduction import (
    ReductionError,
    solved_adequately,
    with_inertia,
    with_swings,
    without_swings,
)
from muscle_bayes.inference.posteriors.assemble import PREDICTIVE_DRAWS
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.posteriors.predict import Prediction, predict, thin
from muscle_bayes.inference.posteriors.starts import SETTLING_SHARE, resting_starts, settled_starts
from muscle_bayes.inference.running.blas import one_blas_thread
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.search.pivots import pivoted


@double_precision
@one_blas_thread
def predict_runs(
    posterior: Posterior, runs: Sequence[Run], *, draws: int = PREDICTIVE_DRAWS, seed: int = 0
) -> list[Prediction]:
    """Predictions of runs, whether the posterior has seen them or not.

    A run with the name of a fitted one keeps that run's own zero, start and first HYST strain. So a
    record that continues past the fitted part is predicted ahead. Another run's own unknowns are
    estimated from its first 30 % (SETTLING_SHARE), and the rest is predicted ahead.

    Args:
        posterior: of runs of the same kind.
        runs: as `read_runs` gives them.
        draws: how many draws of the posterior are simulated.
        seed: of the random numbers.

    Returns:
        A prediction for each run: draws of its readings [the log's unit] over time [s]. Draws in which a
        run cannot be solved are left out, a tenth of them at most.

    Raises:
        MuscleBayesError: if the runs need parameters that the posterior lacks, or cannot be solved in more
            than a tenth of the draws.

    Example:
        >>> import muscle_bayes as mb
        >>> runs = mb.load_example("springs")
        >>> posterior = mb.fit(runs, effort="quick", progress=False)
        >>> prediction = mb.predict(posterior, runs, draws=50)[0]
        >>> prediction.run, prediction.unit, prediction.reading.shape[0]
        ('spring-1', 'counts', 50)
    """
    refuse_all_but(Posterior, posterior, "posterior", "give one that `fit` or `load` returns")
    refuse_unread(runs)
    seen = set(json.loads(posterior.tree.attrs["runs"]))
    found: dict[str, Prediction] = {}
    for known in (True, False):
        part = [run for run in runs if (run.name in seen) == known]
        if part:
            for one in _predict_part(posterior, part, known, draws, seed):
                found[one.run] = one
    return [found[run.name] for run in runs]


def carried_over(problem: Problem, thinned: dict[str, Any]) -> dict[str, Any]:
    """Draws of a posterior as what the problem shares with it: everything that is no run's own.

    A muscle is carried over by Table 2's parameters, in N/m and strain, and described as the problem does.
    """
    shared = [name for name, shape in problem.layout.shapes if not shape]
    values = {name: thinned[name] for name in shared if name in thinned}
    if "K_modulus" in thinned:
        data = problem.data
        table = {name: thinned[name] for name in MUSCLE_PARAMETERS}
        known = completed(table, data.base_length, data.tension, frame_of(values, data))
        known[TAUT_FORCE] = (known["taut_strain"] - data.first_strain) * known["modulus"]
        values |= {name: known[name] for name in shared if name in known}
    if missing := [name for name in shared if name not in values]:
        raise MuscleBayesError(
            f"the posterior has no {', '.join(missing)}, which these runs need. "
            "Fix: fit runs of their kind as well."
        )
    return values


def _solved(predictions: Sequence[Prediction], most: float = 0.1) -> list[Prediction]:
    """Predictions without draws in which a run cannot be solved, at `most` this share of them.

    A draw's own start can end where no force balances: where a minimum force holds a spring.
    """
    finite = np.all([np.isfinite(one.model).all(axis=1) for one in predictions], axis=0)
    if finite.mean() < 1.0 - most:
        raise MuscleBayesError(
            f"{', '.join(one.run for one in predictions)}: the model cannot be solved in "
            f"{np.sum(~finite)} of {finite.size} draws. Fix: check the metadata of these runs "
            "(geometry, load, temperatures), or fit runs of their kind as well."
        )
    arrays = ("model", "reading", "hyst")
    return [
        one._replace(**{k: getattr(one, k)[finite] for k in arrays}, unsolved=int(np.sum(~finite)))
        for one in predictions
    ]


def _predict_part(
    posterior: Posterior, runs: Sequence[Run], known: bool, draws: int, seed: int
) -> list[Prediction]:
    problem = pose(runs, posterior.friction, posterior.effects)
    group = posterior.tree["posterior"].to_dataset()
    names = {
        *json.loads(posterior.tree.attrs["sampled"]),
        *(name for name, _ in problem.layout.shapes),
        *MUSCLE_PARAMETERS,
    }
    thinned = thin({name: group[name].to_numpy() for name in names if name in group}, draws)
    values = carried_over(problem, thinned)
    if not known:
        # Without inertia: a swing says little of where a run begins, and its derivatives grow with time.
        settled = settled_starts(problem, resting_starts(problem, values), seed + 1)
        better = _improved(problem, settled)
        share = {run.name: SETTLING_SHARE * run.duration for run in runs}
        predictions = _solved(predict(better, settled, seed))
        return [one._replace(ahead_from=share[one.run]) for one in predictions]
    for name, shape in problem.layout.shapes:
        if shape:
            regime = name.partition(".")[0]
            there = [str(run) for run in group[f"{regime}_run"].to_numpy()]
            chosen = [there.index(run) for run in problem.site_runs[regime]]
            values[name] = thinned[name][:, jnp.asarray(chosen)]
    stored = json.loads(posterior.tree.attrs["reduction"])
    kept = {run: ReductionError(**error) for run, error in stored.items()}
    heavy = [run for run, error in kept.items() if not error.tolerable]
    middle = _middle(problem, values)
    swung = with_swings(_pivoted(problem, values), middle)
    # As the fit: it knew no swing where full inertia could not be solved.
    swung = without_swings(swung, [run for run, error in kept.items() if not error.solved])
    return predict(with_inertia(swung, middle, heavy), values, seed)


def _middle(problem: Problem, draws: Any) -> dict[str, Any]:
    return {name: jnp.median(draws[name], axis=0) for name, _ in problem.layout.shapes}


def _pivoted(problem: Problem, draws: Any) -> Problem:
    """The problem with segments' pivots where the middle of the draws puts them."""
    layout, data = problem.layout, problem.data
    vector = unconstrain(_middle(problem, draws), layout, data)
    return replace(problem, data=pivoted(vector, layout, data))


def _improved(problem: Problem, draws: Any) -> Problem:
    """The problem with what the middle of the draws tells: segments' pivots, which runs need inertia."""
    return solved_adequately(_pivoted(problem, draws), _middle(problem, draws))


@double_precision
@one_blas_thread
def predict_from_prior(
    runs: Sequence[Run],
    friction: Friction = "coulomb",
    effects: Sequence[str] = (),
    *,
    draws: int = PREDICTIVE_DRAWS,
    seed: int = 0,
) -> list[Prediction]:
    """What the priors alone say of these runs: draws that could not be real show a poor prior.

    Args:
        runs: as `read_runs` gives them.
        friction: "coulomb" or "linear", as in `fit`.
        effects: names of effects, in the order in which they act.
        draws: how many draws of the prior are simulated.
        seed: of the random numbers.

    Returns:
        A prediction for each run: draws of its readings [the log's unit] over time [s]. Draws in which a
        run cannot be solved are left out, nine in ten of them at most.

    Raises:
        MuscleBayesError: for runs that cannot be fitted together or are solved in hardly a draw, and for
            unknown effects.

    Example:
        >>> import muscle_bayes as mb
        >>> predictions = mb.prior_predict(mb.load_example("spring-1"), draws=20)
        >>> predictions[0].model.shape[0]
        20
    """
    problem = pose(runs, friction, effects)
    values = prior_draws(jax.random.key(seed), draws, problem.layout, problem.data)
    # A prior reaches far: much of it may be where no force balances.
    return _solved(predict(problem, values, seed + 1), most=0.9)
