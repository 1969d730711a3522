"""The workflow: locate, candidates, fit all, weigh, gate, add, and again."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from time import monotonic

import numpy as np

from muscle_bayes.conventions import Friction
from muscle_bayes.data.run import Run, refuse_unread
from muscle_bayes.discovery.candidates import could_show, log_bayes_factors
from muscle_bayes.discovery.conditions import traces
from muscle_bayes.discovery.draws import Draws
from muscle_bayes.discovery.fit import Fitted, OutOfTime, Search
from muscle_bayes.discovery.functions import add_function
from muscle_bayes.discovery.gate import Gate, Unseen, gate_by_runs
from muscle_bayes.discovery.locate import locate
from muscle_bayes.discovery.nominal import nominal
from muscle_bayes.discovery.outcome import Found, Link, outcome
from muscle_bayes.discovery.result import Discovery
from muscle_bayes.discovery.search import (
    evidence,
    fit_candidates,
    from_starts,
    scored,
    with_own_motion,
)
from muscle_bayes.discovery.weigh import (
    NONE,
    Naming,
    blocks_of,
    could_claim,
    in_dispute,
    linear,
    weigh,
)
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.records.open_delay import with_open_delay
from muscle_bayes.inference.records.rig import has_muscle
from muscle_bayes.inference.running.blas import one_blas_thread
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.physics.effect import MUSCLE_PORTS
from muscle_bayes.physics.effects import CATALOGUE, AnyEffectType, own_effects
from muscle_bayes.physics.effects.own import given
from muscle_bayes.progress import Report, silent

NOTHING_LEFT = "nothing significant that a named effect explains remains"


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
    effects = with_open_delay(runs, effects)
    chosen = applicable(runs, effects) if candidates is None else candidates
    names = [one if isinstance(one, str) else given(one) for one in chosen]
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


def add_names(
    found: Found, names: Sequence[str], smallest: float, told: Callable[[str], None], most: int = 3
) -> None:
    """Named effects, one after the other while readings not seen are predicted better by them."""
    search, remaining = found.search, list(names)
    while True:
        current = found.last
        begun = search.slow(current)
        search.report("score test", len(found.links), most)
        screened = scored(search, begun, remaining, search.seed)
        if found.visible is None:
            found.visible = could_show(screened)
            told(found.visible.text())
        left = found.left
        if left.steps < smallest or not could_claim(left.p_value) or len(found.links) == most:
            found.naming = found.naming or linear(log_bayes_factors(screened)).supported(
                left.p_value
            )
            found.stopped = NOTHING_LEFT
            if left.significant and left.steps < smallest:
                found.stopped = (
                    f"the misfit that is left is small: {left.steps:.2g} steps of the sensor RMS, "
                    f"below {smallest:g}"
                )
            elif len(found.links) == most and left.significant:
                found.stopped = f"{most} effects were added, which is the most"
            return
        better, fits = fit_candidates(search, begun, screened)
        near = with_own_motion(search, fits)
        if better.log_evidence > begun.log_evidence + 3.0:
            current = max(current, search.settled(better), key=evidence)
        naming = _weighed(found, current, near, fits)
        found.naming = found.naming or naming
        _set_last(found, current)
        if not naming.claims:
            found.stopped = NOTHING_LEFT
            return
        after = near[naming.best]
        gate = judge(search, current, after)
        if not gate.passed:
            found.stopped = (
                f"{naming.best} would come next, but does not predict unseen readings better: "
                f"{gate.gain:+.1f} nat, standard error {gate.se:.1f}"
            )
            return
        rival = near.get(naming.tie[1]) if naming.tie else None
        found.links.append(Link(naming.best, naming, current, after, gate, search, rival))
        remaining.remove(naming.best)
        for index in range(len(found.links) - 1):
            _replace(found, index, remaining)
        found.left = locate(search, found.last)


def _replace(found: Found, index: int, remaining: list[str]) -> None:
    """Another effect in the place of an earlier one, where the whole set is likelier with it.

    What explains most of a misfit alone may explain little of it beside what was added later.
    """
    search, last, old = found.search, found.last, found.links[index].effect
    present = tuple(link.effect for link in found.links if link.effect != old)
    (without,) = search.fit([search.with_effects(last, present)])
    begun = search.slow(without)
    fits = from_starts(search, scored(search, begun, remaining, search.seed + 1))
    near = with_own_motion(search, fits, most=2)
    best = max(near, key=lambda name: near[name].log_evidence, default=None)
    if best is None or near[best].log_evidence < last.log_evidence + 3.0:
        return
    remaining[:] = [old, *(name for name in remaining if name != best)]
    naming = _weighed(found, without, {**near, old: last}, {**fits, old: last})
    order = [best if link.effect == old else link.effect for link in found.links]
    before, links = found.base, []
    for size, link in enumerate(found.links, 1):
        (after,) = search.fit([search.with_effects(near[best], order[:size])])
        after = search.settled(after)
        new = replace(link, effect=order[size - 1], before=before, after=after)
        if link.effect == old:
            new = replace(new, naming=naming, rival=near.get(naming.tie[1]) if naming.tie else None)
        links.append(replace(new, gate=judge(search, before, after)))
        before = after
    found.links = links
    if index == 0:
        found.naming = naming


def _set_last(found: Found, current: Fitted) -> None:
    """A better fit of the model that candidates were compared with takes its place."""
    if found.links:
        found.links[-1].after = current
    else:
        found.base = current


def _weighed(
    found: Found, base: Fitted, near: Mapping[str, Fitted], fits: Mapping[str, Fitted]
) -> Naming:
    """Probabilities of all candidates, those of the two likeliest checked against sampled posteriors."""
    search = found.search
    best = max([base, *near.values()], key=evidence)
    lines = traces(search.nested, base)
    blocks = blocks_of(lines, in_dispute(base, best))
    naming = weigh(base, near, blocks, search.seed, among=len(fits))
    naming = naming.with_far(
        {n: one.log_evidence for n, one in fits.items() if n not in near},
        {n: fits[n].log_evidence for n in near},
    )
    models = {NONE: base, **near}
    checked: dict[str, Draws] = {}
    for name in [name for name in naming.order if name in models][:2]:
        search.report("sampling to check", len(checked), 2)
        checked[name] = found.draws_of(search, models[name])
        found.checks.append(checked[name].text(name))
    corrections = {name: one.log_evidence - one.laplace for name, one in checked.items()}
    if not all(one.good for one in checked.values()):
        corrections = {}
    return naming.corrected(corrections).supported(found.left.p_value)


def judge(search: Search, before: Fitted, after: Fitted) -> Gate:
    """By blocks of the fitted runs in turn, and by held-out runs where there are any."""
    search.report("gate", 0, 1)
    lines = traces(search.nested, before)
    blocks = blocks_of(lines, in_dispute(before, after))
    models = {"before": before, "after": after}
    gate = Unseen(search, models, blocks).gate("before", "after")
    if not search.held:
        return gate
    whole = traces(search.nested, before, whole=True)
    return gate.weighed_with(gate_by_runs(search, before, after, whole))
