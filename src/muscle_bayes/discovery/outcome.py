"""What a search knows so far, and what it makes of that: verdict, probabilities, steps with predictions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from muscle_bayes.criticism.coverage import check_run
from muscle_bayes.discovery.candidates import Visibility
from muscle_bayes.discovery.conditions import is_settled
from muscle_bayes.discovery.draws import (
    Draws,
    curve,
    estimates,
    noise_floor,
    predictions,
    sampled,
    undetermined,
)
from muscle_bayes.discovery.fit import Search
from muscle_bayes.discovery.fitted import Fitted
from muscle_bayes.discovery.gate import Gate
from muscle_bayes.discovery.locate import MisfitMap, locate
from muscle_bayes.discovery.next_experiment import propose
from muscle_bayes.discovery.result import Discovery, Judged, NextExperiment, Step
from muscle_bayes.discovery.search import scored
from muscle_bayes.discovery.weigh import CLAIM, NONE, UNKNOWN, Naming, linear, unexplained
from muscle_bayes.inference.posteriors.starts import SETTLING_SHARE
from muscle_bayes.inference.search.nested import is_function
from muscle_bayes.physics.effects import effect_type
from muscle_bayes.physics.effects.empirical import function_type


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

    _drawn: list[tuple[Fitted, Draws]] = field(default_factory=list)

    def draws_of(self, search: Search, fitted: Fitted) -> Draws:
        """Draws of a model's posterior; sampled once."""
        for known, drawn in self._drawn:
            if known is fitted:
                return drawn
        self._drawn.append((fitted, sampled(search, fitted)))
        return self._drawn[-1][1]

    @property
    def last(self) -> Fitted:
        """The model with all named effects."""
        return self.links[-1].after if self.links else self.base


def outcome(found: Found, smallest: float) -> Discovery:
    """The result of a search, ended or not."""
    search, naming = found.search.patient, found.naming or linear({})
    probabilities = _probabilities(found, naming, smallest)
    links, remainder = [] if found.replaces else list(found.links), None
    if found.unknown is not None:
        if links and sum(link.share or 0.0 for link in links) >= 0.9:
            remainder = found.unknown
        else:
            links.append(found.unknown)
    search.report("predictions", 0, 1)
    nominal = before = _judged(search, found.base, None, found.located)
    steps = []
    for link in [*links, *([remainder] if remainder else [])]:
        first = link.naming is found.naming
        known = probabilities if first else link.naming.probabilities
        steps.append(_step(found, link, known.get(link.effect, probabilities[UNKNOWN]), before))
        before = steps[-1].after
    rest = steps.pop() if remainder else None
    return Discovery(
        verdict=_verdict(steps, probabilities, found.left, smallest),
        probabilities=probabilities,
        naming=naming,
        visible=found.visible,
        located=found.located,
        nominal=nominal,
        steps=tuple(steps),
        held_out=search.held,
        floor=noise_floor(search),
        next_experiment=_next(found, links),
        stopped_because=found.stopped,
        checks=tuple(found.checks),
        not_searched=tuple(found.not_searched),
        remainder=rest,
        smallest=smallest,
        seed=search.seed,
    )


def _probabilities(found: Found, naming: Naming, smallest: float) -> dict[str, float]:
    """Of every effect, of none and of something unknown."""
    left, odds = found.left, found.odds
    if odds is None:
        odds = 1.0 if left.significant or left.steps < smallest else unexplained(left.p_value)
    # A misfit that neither an effect nor a function describes speaks for something unknown all the same.
    small = found.links or left.steps < smallest
    return naming.with_unknown(odds, 1.0 if small else unexplained(found.located.p_value))


def _next(found: Found, links: Sequence[Link]) -> NextExperiment | None:
    """What would separate the first tie, or, with nothing found, show what could not have been seen."""
    search = found.search.patient
    for link in links:
        if link.rival is not None:
            return propose(link.search.nested, link.after, link.rival)
    if links or found.visible is None or found.not_searched:
        return None
    for name in found.visible.unseen:
        screened = scored(search, found.base, [name], search.seed)[name]
        whole = [one for one in screened if one.strength == 1.0]
        if whole:
            (shown,) = search.fit([whole[len(whole) // 2].start], steps=0)
            return propose(search.nested, shown, found.base)
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
    found = {each.run: each for each in predictions(search, fitted, drawn)}
    for run in search.nested.problem.runs:
        if run.name in search.held:
            found[run.name] = found[run.name]._replace(ahead_from=SETTLING_SHARE * run.duration)
    checks = {
        name: check_run(each.only(is_settled(each.time, each.load, each.temperature)))
        for name, each in found.items()
    }
    return Judged(fitted.effects, found, checks, misfit)


def _step(found: Found, link: Link, probability: float, before: Judged) -> Step:
    search, unnamed = link.search.patient, is_function(link.effect)
    nested, drawn = search.nested, found.draws_of(search, link.after)
    left = found.left if link.after is found.last else locate(search, link.after)
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
        after=_judged(search, link.after, drawn, left),
        weakened=undetermined(nested, link.before, link.after),
        share=link.share,
    )
