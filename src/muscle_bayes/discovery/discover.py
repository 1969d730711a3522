"""The workflow: locate, candidates, fit all, weigh, gate, add, and again."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from time import monotonic

import numpy as np

from muscle_bayes.conventions import Friction
from muscle_bayes.data.run import Run, refuse_unread
from muscle_bayes.discovery.fit import OutOfTime
from muscle_bayes.discovery.functions import add_function
from muscle_bayes.discovery.locate import locate
from muscle_bayes.discovery.nominal import nominal
from muscle_bayes.discovery.outcome import Found, outcome
from muscle_bayes.discovery.result import Discovery
from muscle_bayes.discovery.selection import add_names
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.records.open_delay import with_open_delay
from muscle_bayes.inference.running.blas import one_blas_thread
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.physics.effect import MUSCLE_PORTS
from muscle_bayes.physics.effects import CATALOGUE, AnyEffectType, own_effects
from muscle_bayes.physics.effects.own import effect_names
from muscle_bayes.progress import Report, silent


def applicable(
    runs: Sequence[Run], present: Sequence[str], known: Mapping[str, AnyEffectType] | None = None
) -> list[str]:
    """Effects `known` that these runs could show and that the model does not have.

    Known are those of the catalogue and the user's own, unless said.
    """
    known = {**CATALOGUE, **own_effects()} if known is None else known
    present = with_open_delay(runs, present)
    muscle = any(run.has_muscle for run in runs)
    return [
        name
        for name, effect in known.items()
        if name not in present and (muscle or effect.port not in MUSCLE_PORTS)
    ]


@double_precision
@one_blas_thread
def discover(
    runs: Sequence[Run],
    *,
    hold_out: Sequence[str] = (),
    friction: Friction = "coulomb",
    effects: Sequence[str] = (),
    candidates: Sequence[str | AnyEffectType] | None = None,
    seed: int = 0,
    report: Report = silent,
    told: Callable[[str], None] = lambda text: None,
    workers: int = 2,
    budget: float | None = None,
    smallest: float = 0.25,
) -> Discovery:
    """Which effect is missing from the model of these runs?

    Args:
        runs: as `read_runs` gives them.
        hold_out: names of runs that are predicted only. Their first part identifies their own start.
        friction: "coulomb" or "linear", as in `fit`.
        effects: those that the model has already.
        candidates: effects that may be added: names, or classes of your own; default: all `applicable`.
        seed: of the random numbers.
        report: called with stage, done and total as the search goes on.
        told: called with sentences worth reading before the search ends: what these runs could show.
        workers: rows that are evaluated side by side; the result does not depend on it.
        budget: minutes after which the best answer so far is given; default: none.
        smallest: RMS misfit that counts, in steps of the sensor; less is reported as small, not claimed.
            For a sensor finer than its noise, a step is one standard deviation of a reading.

    Returns:
        The verdict: "none", "unknown", or the names of effects; with probabilities, where the misfit
        lies, the effects' parameters with units, and what to record next. A search that is interrupted,
        or whose budget ends, answers from what it has, and says what it did not search.

    Raises:
        MuscleBayesError: for names that no run has, when no run is left to fit, and for candidates
            that the model has already. Also for runs that cannot be fitted together.

    Example:
        >>> import muscle_bayes as mb
        >>> runs = mb.load_example("springs")
        >>> found = mb.discover(runs, hold_out=["spring-5"], candidates=["viscous-friction"])
        >>> found.verdict
        'none'
    """
    deadline = np.inf if budget is None else monotonic() + 60.0 * budget
    _check(runs, hold_out)
    effects = with_open_delay(runs, effect_names(effects))
    chosen = applicable(runs, effects) if candidates is None else candidates
    names = effect_names(chosen)
    if present := sorted({*names} & {*effects}):
        raise MuscleBayesError(
            f"the model has {', '.join(present)} already. Fix: name candidates that it does not have."
        )
    report("nominal model", 0, 1)
    search, base = nominal(
        runs, friction, effects, names, hold_out, seed, workers=workers, report=report
    )
    report("nominal model", 1, 1)
    located = locate(search, base)
    found = Found(replace(search, deadline=deadline), base, located, located)
    try:
        add_names(found, names, smallest, told)
        if found.left.significant and found.left.steps >= smallest:
            add_function(found)
    except (KeyboardInterrupt, OutOfTime) as stop:
        cause = "the budget ended" if isinstance(stop, OutOfTime) else "it was interrupted"
        found.stopped = cause
        found.not_searched.append(f"what was under way when {cause}, and all that would follow")
    return outcome(found, smallest)


def _check(runs: Sequence[Run], hold_out: Sequence[str]) -> None:
    refuse_unread(runs)
    names = [run.name for run in runs]
    for name in hold_out:
        if name not in names:
            raise MuscleBayesError(
                f"--hold-out {name}: no such run. Fix: name one of {', '.join(names)}."
            )
    if set(names) <= set(hold_out):
        raise MuscleBayesError(
            "every run is held out. Fix: leave out one --hold-out, or add a run."
        )
