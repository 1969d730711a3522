"""The workflow: locate, candidates, fit all, weigh, gate, add, and again."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from time import monotonic

import numpy as np

from muscle_bayes.conventions import Friction
from muscle_bayes.criticism.coverage import check_run
from muscle_bayes.data.run import Run
from muscle_bayes.discovery.candidates import Visibility, could_show, log_bayes_factors
from muscle_bayes.discovery.conditions import is_settled, traces
from muscle_bayes.discovery.draws import (
    Draws,
    curve,
    estimates,
    noise_floor,
    predictions,
    sampled,
    undetermined,
)
from muscle_bayes.discovery.fit import Fitted, Report, settled, with_effects
from muscle_bayes.discovery.functions import fit_functions, function_names, ports
from muscle_bayes.discovery.gate import Gate, Unseen, gate_by_runs
from muscle_bayes.discovery.locate import MisfitMap, locate
from muscle_bayes.discovery.next_experiment import propose
from muscle_bayes.discovery.nominal import nest, nominal
from muscle_bayes.discovery.result import Discovery, Judged, NextExperiment, Step
from muscle_bayes.discovery.search import (
    OutOfTime,
    Search,
    fit_candidates,
    from_starts,
    slow,
    with_own_motion,
)
from muscle_bayes.discovery.weigh import (
    CLAIM,
    NONE,
    UNKNOWN,
    Naming,
    blocks_of,
    could_claim,
    in_dispute,
    linear,
    unexplained,
    weigh,
)
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.posteriors.starts import SETTLING_SHARE
from muscle_bayes.inference.records.open_delay import with_open_delay
from muscle_bayes.inference.records.rig import has_muscle
from muscle_bayes.inference.running.blas import one_blas_thread
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.search.nested import is_function
from muscle_bayes.physics.effect import MUSCLE_PORTS
from muscle_bayes.physics.effects import CATALOGUE, AnyEffectType, effect_type, own_effects
from muscle_bayes.physics.effects.empirical import TERMS, function_type
from muscle_bayes.physics.effects.own import given

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


@dataclass
class Link:
    """An effect that was added."""

    effect: str
    naming: Naming
    before: Fitted
    after: Fitted
    gate: Gate
    search: Search
    rival: Fitted | None = None
    """The next likeliest of a tie."""
    share: float | None = None


@dataclass
class Found:
    """What is known so far: an interrupted search answers from it."""

    search: Search
    base: Fitted
    located: MisfitMap
    left: MisfitMap
    links: list[Link] = field(default_factory=list)
    naming: Naming | None = None
    """Of the first step."""
    visible: Visibility | None = None
    checks: list[str] = field(default_factory=list)
    unknown: Link | None = None
    """A function, beside the names or, where it `replaces` them, instead."""
    replaces: bool = False
    odds: float | None = None
    """Of something unknown against the names."""
    stopped: str = ""
    not_searched: list[str] = field(default_factory=list)

    @property
    def last(self) -> Fitted:
        """The model with all named effects."""
        return self.links[-1].after if self.links else self.base


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
    report: Report = lambda stage, done, total: None,
    told: Callable[[str], None] = lambda text: None,
    workers: int = 2,
    budget: float | None = None,
    smallest: float = 0.25,
) -> Discovery:
    """Which effect is missing from the model of these runs?

    Args:
        runs: as `read_runs` gives them.
        hold_out: names of runs that are predicted only, after their first part has told their own
            start.
        friction: "coulomb" or "linear", as in `fit`.
        effects: those that the model has already.
        candidates: effects that may be added: names, or classes of your own; default: all `applicable`.
        seed: of the random numbers.
        report: called with stage, done and total as the search goes on.
        told: called with sentences worth reading before the search ends: what these runs could show.
        workers: rows that are evaluated side by side; the result does not depend on it.
        budget: minutes after which the best answer so far is given; default: none.
        smallest: RMS misfit that counts, in steps of the sensor (of a sensor finer than its noise, in
            standard deviations of a reading): less is reported as small, not claimed.

    Returns:
        The verdict: "none", "unknown", or the names of effects; with probabilities, where the misfit
        lies, the effects' parameters with units, and what to record next. A search that is interrupted,
        or whose budget ends, answers from what it has, and says what it did not search.

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
    nested, base = nominal(runs, friction, effects, names, hold_out, seed, workers)
    search = Search(nested, seed, tuple(hold_out), workers, report, deadline)
    report("nominal model", 1, 1)
    located = locate(nested, base, seed, workers=workers)
    found = Found(search, base, located, located)
    try:
        add_names(found, names, smallest, told)
        if found.left.significant and found.left.steps >= smallest:
            add_function(found)
    except (KeyboardInterrupt, OutOfTime) as stop:
        cause = "the budget ended" if isinstance(stop, OutOfTime) else "it was interrupted"
        found.stopped = cause
        found.not_searched.append(f"what was under way when {cause}, and all that would follow")
    return _result(found, smallest)


def _check(runs: Sequence[Run], hold_out: Sequence[str]) -> None:
    names = [run.name for run in runs]
    for name in hold_out:
        if name not in names:
            raise MuscleBayesError(
                f"--hold-out {name}: no such run. Fix: name one of {', '.join(names)}."
            )
    if set(names) <= set(hold_out):
        raise MuscleBayesError("every run is held out; leave at least one to fit")


def add_names(
    found: Found, names: Sequence[str], smallest: float, told: Callable[[str], None], most: int = 3
) -> None:
    """Named effects, one after the other while readings not seen are predicted better by them."""
    search, remaining = found.search, list(names)
    while True:
        current = found.last
        begun = slow(search, current)
        search.report("score test", len(found.links), most)
        screened = search.scored(begun, remaining, search.seed)
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
            current = max(
                current, settled(search.nested, better, workers=search.workers), key=_evidence
            )
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
        found.left = locate(search.nested, found.last, search.seed, workers=search.workers)


def _replace(found: Found, index: int, remaining: list[str]) -> None:
    """Another effect in the place of an earlier one, where the whole set is likelier with it.

    What explains most of a misfit alone may explain little of it beside what was added later.
    """
    search, last, old = found.search, found.last, found.links[index].effect
    present = tuple(link.effect for link in found.links if link.effect != old)
    (without,) = search.fit([with_effects(search.nested, last, present)])
    begun = slow(search, without)
    fits = from_starts(search, search.scored(begun, remaining, search.seed + 1))
    near = with_own_motion(search, fits, most=2)
    best = max(near, key=lambda name: near[name].log_evidence, default=None)
    if best is None or near[best].log_evidence < last.log_evidence + 3.0:
        return
    remaining[:] = [old, *(name for name in remaining if name != best)]
    naming = _weighed(found, without, {**near, old: last}, {**fits, old: last})
    order = [best if link.effect == old else link.effect for link in found.links]
    before, links = found.base, []
    for size, link in enumerate(found.links, 1):
        start = with_effects(search.nested, near[best], order[:size])
        after = settled(search.nested, search.fit([start])[0], workers=search.workers)
        new = replace(link, effect=order[size - 1], before=before, after=after)
        if link.effect == old:
            new = replace(new, naming=naming, rival=near.get(naming.tie[1]) if naming.tie else None)
        links.append(replace(new, gate=judge(search, before, after)))
        before = after
    found.links = links
    if index == 0:
        found.naming = naming


def _evidence(one: Fitted) -> float:
    return one.log_evidence


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
    best = max([base, *near.values()], key=_evidence)
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
        checked[name] = sampled(search.nested, models[name], search.seed, workers=search.workers)
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
    unseen = Unseen(search.nested, models, blocks, workers=search.workers, tick=search.tick)
    gate = unseen.gate("before", "after")
    if not search.held:
        return gate
    whole = traces(search.nested, before, whole=True)
    runs = gate_by_runs(search.nested, before, after, whole, search.held, search.workers)
    return gate.weighed_with(runs)


def add_function(found: Found, enough: float = 0.9) -> None:
    """The best function beside the names and instead of them, and what each closes of the gap.

    Names that close `enough` of what the best function closes on unseen readings stay; the function then
    describes the remainder. Otherwise the verdict is unknown, unless the names help the function too.
    """
    search, base, last = found.search, found.base, found.last
    search.report("functions", 0, 2)
    unnamed = ports(search.nested)
    whole, (plain, named) = nest(search.nested, (*last.effects, *unnamed), (base, last), TERMS + 8)
    inner = replace(search, nested=whole)
    names = function_names(traces(whole, named), unnamed)
    models = {"none": plain, "names": named}
    for key, one in {"instead": plain, "beside": named}.items():
        if key == "beside" and not found.links:
            break
        begun = slow(inner, one)
        fits = fit_functions(
            whole, begun, names, inner.noise, workers=search.workers, tick=search.tick
        )
        if fits:
            likeliest = max(fits.values(), key=_evidence)
            models[key] = settled(whole, likeliest, workers=search.workers)
        search.report("functions", 1, 2)
    top = max(models.values(), key=_evidence)
    blocks = blocks_of(traces(whole, plain), in_dispute(plain, top))
    unseen = Unseen(whole, models, blocks, workers=search.workers, tick=search.tick)
    closed = {name: unseen.closed("none", name) for name in models}
    most = max(closed.values())
    share = closed["names"] / most if most > 0.0 else 1.0
    _shares(found, most)
    instead = models.get("instead")
    beside = models.get("beside") if found.links else instead
    lead = -np.inf if instead is None else instead.log_evidence - named.log_evidence
    helped = beside is not None and beside.log_evidence > (
        -np.inf if instead is None else instead.log_evidence + 3.0
    )
    found.replaces = share < enough and lead > 0.0 and not (found.links and helped)
    found.odds = float(np.exp(np.clip(lead, 0.0, 700.0))) if found.replaces else 1.0
    key = "instead" if found.replaces or not found.links else "beside"
    before = "none" if found.replaces else "names"
    after = models.get(key)
    if after is None:
        return
    gate = unseen.gate(before, key)
    if not gate.passed:
        found.replaces, found.odds = False, 1.0
        return
    blank = Naming({}, {}, {})
    rest = (closed[key] - closed[before]) / most if most > 0.0 else 0.0
    found.unknown = Link(after.effects[-1], blank, models[before], after, gate, inner, share=rest)
    if found.replaces or share < enough:
        found.stopped = "what is left is described by a function that nobody has named"


def _shares(found: Found, most: float) -> None:
    """What each named effect closes of the gap that any model closes, on readings left out."""
    if not found.links or most <= 0.0:
        return
    nested, links = found.search.nested, found.links
    models = {"none": found.base, **{link.effect: link.after for link in links}}
    blocks = blocks_of(traces(nested, found.base), in_dispute(found.base, found.last))
    unseen = Unseen(nested, models, blocks, workers=found.search.workers)
    closed = 0.0
    for link in links:
        now = unseen.closed("none", link.effect)
        link.share, closed = (now - closed) / most, now


def _result(found: Found, smallest: float) -> Discovery:
    search, left, links = found.search, found.left, list(found.links)
    naming = found.naming or linear({})
    odds = found.odds
    if odds is None:
        odds = 1.0 if left.significant or left.steps < smallest else unexplained(left.p_value)
    # A misfit that neither an effect nor a function describes speaks for something unknown all the same.
    against = 1.0 if links or left.steps < smallest else unexplained(found.located.p_value)
    probabilities = naming.with_unknown(odds, against)
    if found.replaces:
        links = []
    remainder = None
    if found.unknown is not None:
        closes = sum(link.share or 0.0 for link in links) >= 0.9 and not found.replaces and links
        if closes:
            remainder = found.unknown
        else:
            links.append(found.unknown)
    search.report("predictions", 0, 1)
    nominal_ = _judged(search, found.base, None, found.located)
    steps, before = [], nominal_
    last = None
    for link in [*links, *([remainder] if remainder else [])]:
        drawn = sampled(link.search.nested, link.after, search.seed, workers=search.workers)
        misfit = (
            left
            if link.after is found.last
            else locate(link.search.nested, link.after, search.seed, workers=search.workers)
        )
        after = _judged(link.search, link.after, drawn, misfit)
        p = link.naming.probabilities.get(link.effect)
        p = probabilities[UNKNOWN] if p is None else p
        p = probabilities[link.effect] if link.naming is found.naming else p
        last = _step(link, drawn, p, before, after)
        steps.append(last)
        before = after
    rest = steps.pop() if remainder else None
    return Discovery(
        verdict=_verdict(steps, probabilities, left, smallest),
        probabilities=probabilities,
        naming=naming,
        visible=found.visible,
        located=found.located,
        nominal=nominal_,
        steps=tuple(steps),
        held_out=search.held,
        floor=noise_floor(search.nested),
        next_experiment=_next(found, links),
        stopped_because=found.stopped,
        checks=tuple(found.checks),
        not_searched=tuple(found.not_searched),
        remainder=rest,
        smallest=smallest,
        seed=search.seed,
    )


def _next(found: Found, links: Sequence[Link]) -> NextExperiment | None:
    """What would separate the first tie, or, with nothing found, show what could not have been seen."""
    for link in links:
        if link.rival is not None:
            return propose(link.search.nested, link.after, link.rival)
    if links or found.visible is None or found.not_searched:
        return None
    for name in found.visible.unseen:
        screened = found.search.scored(found.base, [name], found.search.seed)[name]
        whole = [one for one in screened if one.strength == 1.0]
        if whole:
            (shown,) = found.search.fit([whole[len(whole) // 2].start], steps=0)
            return propose(found.search.nested, shown, found.base)
    return None


def _verdict(
    steps: Sequence[Step], probabilities: Mapping[str, float], left: MisfitMap, smallest: float
) -> str | tuple[str, ...]:
    if not steps:
        counts = left.significant and left.steps >= smallest
        return UNKNOWN if counts and 1.0 - probabilities[NONE] >= CLAIM else NONE
    added = tuple(step.added for step in steps)
    return added[0] if len(added) == 1 else added


def _judged(search: Search, fitted: Fitted, drawn: Draws | None, misfit: MisfitMap) -> Judged:
    drawn = drawn or Draws.laplace_of(fitted, search.seed)
    found = {
        each.run: each
        for each in predictions(search.nested, fitted, drawn, search.seed, workers=search.workers)
    }
    for name in search.held:
        run = next(run for run in search.nested.problem.runs if run.name == name)
        found[name] = found[name]._replace(ahead_from=SETTLING_SHARE * run.duration)
    checks = {
        name: check_run(each.only(is_settled(each.time, each.load, each.temperature)))
        for name, each in found.items()
    }
    return Judged(fitted.effects, found, checks, misfit)


def _step(link: Link, drawn: Draws, probability: float, before: Judged, after: Judged) -> Step:
    unnamed = is_function(link.effect)
    nested = link.search.nested
    return Step(
        added=UNKNOWN if unnamed else link.effect,
        effect=link.effect,
        port=effect_type(link.effect).port,
        signals=(function_type(link.effect).signal,) if unnamed else (),
        probability=probability,
        tie=link.naming.tie if link.naming.probabilities else (),
        parameters=estimates(nested, link.after, drawn, link.effect),
        curve=curve(nested, link.after, drawn, link.effect) if unnamed else None,
        gate=link.gate,
        before=before,
        after=after,
        weakened=undetermined(nested, link.before, link.after),
        share=link.share,
    )
