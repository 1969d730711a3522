"""The workflow: locate, name, add, and again until nothing significant remains."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor

import jax.numpy as jnp

from muscle_bayes.conventions import Friction
from muscle_bayes.criticism.coverage import check_run
from muscle_bayes.data.run import Run
from muscle_bayes.discovery.chain import Chain, Link, chain
from muscle_bayes.discovery.estimates import curve, estimates, noise_floor, undetermined
from muscle_bayes.discovery.explanation import Explanation, Search
from muscle_bayes.discovery.judged import predictions
from muscle_bayes.discovery.locate import MisfitMap, locate
from muscle_bayes.discovery.naming import CLAIM, NONE, UNKNOWN, unexplained
from muscle_bayes.discovery.next_experiment import propose
from muscle_bayes.discovery.nominal import nest, nominal
from muscle_bayes.discovery.result import Discovery, Judged, NextExperiment, Step
from muscle_bayes.discovery.search import Report
from muscle_bayes.discovery.settling import settled
from muscle_bayes.discovery.unknown import Unknown, search_functions
from muscle_bayes.errors import MuscleBayesError, did_you_mean
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.posteriors.predict import Prediction
from muscle_bayes.inference.posteriors.starts import SETTLING_SHARE
from muscle_bayes.inference.records.open_delay import with_open_delay
from muscle_bayes.inference.records.rig import has_muscle
from muscle_bayes.inference.running.blas import one_blas_thread
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.search.descent import Fitted, descend
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.nested_programs import explained_at, slope_at
from muscle_bayes.physics.effect import MUSCLE_PORTS
from muscle_bayes.physics.effects import CATALOGUE, AnyEffectType, effect_type, own_effects
from muscle_bayes.physics.effects.empirical import PREFIX, function_type


def applicable(
    runs: Sequence[Run], present: Sequence[str], known: Mapping[str, AnyEffectType] | None = None
) -> list[str]:
    """Effects `known` that these runs could show and that the model does not have.

    Known are those of the catalogue and the user's own, unless said.
    """
    known = {**CATALOGUE, **own_effects()} if known is None else known
    present = with_open_delay(runs, present)
    muscle = any(has_muscle(run) for run in runs)
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
    candidates: Sequence[str] | None = None,
    seed: int = 0,
    report: Report = lambda stage, done, total: None,
    workers: int = 2,
) -> Discovery:
    """Which effect is missing from the model of these runs?

    Args:
        runs: as `read_runs` gives them.
        hold_out: names of runs that are predicted only, after their first part has told their own
            start.
        friction: "coulomb" or "linear", as in `fit`.
        effects: those that the model has already.
        candidates: effects that may be added; default: all `applicable` ones.
        seed: of the random numbers.
        report: called with stage, done and total as the search goes on.
        workers: candidates that are searched side by side; the result does not depend on it.

    Returns:
        The verdict: "none", "unknown", or the names of effects; with probabilities, where the misfit
        lies, the effects' parameters with units, and what to record next where effects tie.

    Raises:
        MuscleBayesError: for names that no run has, when no run is left to fit, for candidates that
            the model has already, and for runs that cannot be fitted together.

    Example:
        >>> import muscle_bayes as mb
        >>> runs = mb.load_example("springs")
        >>> found = mb.discover(runs, hold_out=["spring-5"], candidates=["viscous-friction"])
        >>> found.verdict
        'none'
    """
    _check(runs, hold_out)
    effects = with_open_delay(runs, effects)
    names = applicable(runs, effects) if candidates is None else list(candidates)
    if present := sorted({*names} & {*effects}):
        raise MuscleBayesError(
            f"the model has {', '.join(present)} already. Fix: name candidates that it does not have."
        )
    report("nominal model", 0, 1)
    with ThreadPoolExecutor(1) as pool:
        _begin_compiling(pool, runs, friction, effects, names)
        start = nominal(runs, friction, effects, seed, hold_out)
    whole, point = nest(start, names)
    held = tuple(hold_out)
    search = Search(whole, whole, held, seed, report, workers).over(whole)
    base = Explanation(search, descend(search.train, tuple(effects), point)).settled()
    named = chain(base, names)
    located = _located(named.base)
    left = located if not named.links else _located(named.last)
    unknown = search_functions(start, named) if left.significant else None
    return _result(named, located, left, unknown)


def _begin_compiling(
    pool: Executor,
    runs: Sequence[Run],
    friction: Friction,
    effects: Sequence[str],
    names: Sequence[str],
) -> None:
    """Compile the nested model while the nominal one is searched; in vain where runs need inertia."""
    nested = Nested(pose(runs, friction, (*effects, *names)))
    choice = nested.choice(effects)
    point = jnp.zeros(nested.shared + choice.slot.size)
    for program in (slope_at, explained_at):
        program.begin(pool, point, choice, nested.layout, nested.data)


def _check(runs: Sequence[Run], hold_out: Sequence[str]) -> None:
    names = [run.name for run in runs]
    for name in hold_out:
        if name not in names:
            raise MuscleBayesError(
                f"--hold-out {name}: no such run.{did_you_mean(name, names)} Fix: name one of "
                f"{', '.join(names)}."
            )
    if set(names) <= set(hold_out):
        raise MuscleBayesError("every run is held out. Fix: leave at least one to fit.")


def _located(one: Explanation) -> MisfitMap:
    return locate(one.search.train, one.fitted, one.search.seed)


def _result(
    named: Chain, located: MisfitMap, left: MisfitMap, unknown: Unknown | None
) -> Discovery:
    last, links, stopped, search = named.last, named.links, named.stopped, named.base.search
    odds = unexplained(left.p_value) if unknown is None else unknown.odds
    # A misfit that neither an effect nor a function describes speaks for something unknown all the same.
    against_none = 1.0 if links else unexplained(located.p_value)
    probabilities = named.naming.with_unknown(odds, against_none)
    function = None if unknown is None else unknown.beside
    if unknown is not None and unknown.replaces:
        links, function = (), unknown.instead
    if function is not None:
        stopped = "what is left is described by a function that nobody has named"
    nominal_ = _judged(named.base, named.base.polished(), located)
    steps, before = [], nominal_
    for link in (*links, *([] if function is None else [function])):
        fitted = link.after.polished()
        after = _judged(link.after, fitted, left if link.after is last else _located(link.after))
        told = probabilities if link.naming is named.naming else link.naming.probabilities
        steps.append(_step(link, fitted, told[link.effect], before, after))
        before = after
    return Discovery(
        verdict=_verdict(steps, probabilities, left),
        probabilities=probabilities,
        naming=named.naming,
        regression=named.regression,
        located=located,
        nominal=nominal_,
        steps=tuple(steps),
        held_out=search.held,
        floor=noise_floor(search.whole),
        next_experiment=_next(links),
        stopped_because=stopped,
        seed=search.seed,
    )


def _next(links: Sequence[Link]) -> NextExperiment | None:
    """What would separate the first tie."""
    for link in links:
        if link.rival is not None:
            return propose(link.rival.search.whole, link.after.fitted, link.rival.fitted)
    return None


def _verdict(
    steps: Sequence[Step], probabilities: Mapping[str, float], left: MisfitMap
) -> str | tuple[str, ...]:
    if not steps:
        claimed = left.significant and 1.0 - probabilities[NONE] >= CLAIM
        return UNKNOWN if claimed else NONE
    added = tuple(step.added for step in steps)
    return added[0] if len(added) == 1 else added


def _settled(one: Prediction) -> Prediction:
    return one.only(settled(one.time, one.load, one.temperature))


def _judged(one: Explanation, fitted: Fitted, misfit: MisfitMap) -> Judged:
    search = one.search
    found = {each.run: each for each in predictions(search.whole, fitted, search.seed)}
    for name in search.held:
        run = next(run for run in search.whole.problem.runs if run.name == name)
        found[name] = found[name]._replace(ahead_from=SETTLING_SHARE * run.duration)
    checks = {name: check_run(_settled(each)) for name, each in found.items()}
    return Judged(fitted.effects, found, checks, misfit)


def _step(link: Link, fitted: Fitted, probability: float, before: Judged, after: Judged) -> Step:
    unnamed = link.effect.startswith(f"{PREFIX}-")
    signals = (function_type(link.effect).signal,) if unnamed else ()
    train, seed = link.after.search.train, link.after.search.seed
    return Step(
        added=UNKNOWN if unnamed else link.effect,
        effect=link.effect,
        port=effect_type(link.effect).port,
        signals=signals,
        probability=probability,
        tie=link.naming.tie,
        parameters=estimates(train, fitted, link.effect, seed),
        curve=curve(train, fitted, link.effect, seed) if unnamed else None,
        gate=link.gate,
        before=before,
        after=after,
        weakened=undetermined(train, link.before.fitted, link.after.fitted),
    )
