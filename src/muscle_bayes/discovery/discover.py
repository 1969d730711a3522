"""The workflow: locate, name, add, and again until nothing significant remains."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np

from muscle_bayes.conventions import Friction
from muscle_bayes.criticism.coverage import check_run
from muscle_bayes.data.run import Run
from muscle_bayes.discovery import functions
from muscle_bayes.discovery.conditions import traces
from muscle_bayes.discovery.estimates import estimates, noise_floor, undetermined
from muscle_bayes.discovery.gate import Gate, gate_by_blocks, gate_by_runs
from muscle_bayes.discovery.holding import without_runs
from muscle_bayes.discovery.judged import predictions
from muscle_bayes.discovery.locate import MisfitMap, locate
from muscle_bayes.discovery.naming import NONE, UNKNOWN, Naming, blocks_of, unexplained, weigh
from muscle_bayes.discovery.next_experiment import propose
from muscle_bayes.discovery.nominal import Nominal, nest, nominal
from muscle_bayes.discovery.result import Discovery, Judged, NextExperiment, Step
from muscle_bayes.discovery.search import fit_candidates
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.descent import Fitted, descend
from muscle_bayes.inference.nested import Nested, explained_at, slope_at
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.problem import pose
from muscle_bayes.inference.rig import has_muscle
from muscle_bayes.inference.starts import SETTLING_SHARE
from muscle_bayes.physics.effect import MUSCLE_PORTS
from muscle_bayes.physics.effects import CATALOGUE, effect_type
from muscle_bayes.physics.effects.empirical import PREFIX, function_type

MOST = 3
"""Effects that are added at most."""

Report = Callable[[str, int, int], None]


@dataclass(frozen=True)
class _Search:
    """What every step needs."""

    whole: Nested
    train: Nested
    """The same, held-out runs known by their starts only."""
    held: tuple[str, ...]
    seed: int
    report: Report

    def over(self, nested: Nested) -> "_Search":
        """The same search in another nested model."""
        return replace(self, whole=nested, train=nested.on(without_runs(nested.problem, self.held)))


@dataclass(frozen=True)
class _Link:
    """An effect that was added to a chain."""

    effect: str
    naming: Naming
    before: Fitted
    after: Fitted
    gate: Gate
    rival: Fitted | None
    """The next likeliest of a tie."""


def applicable(runs: Sequence[Run], present: Sequence[str]) -> list[str]:
    """Effects of the catalogue that these runs could show and that the model does not have."""
    muscle = any(has_muscle(run) for run in runs)
    return [
        name
        for name, effect in CATALOGUE.items()
        if name not in present and (muscle or effect.port not in MUSCLE_PORTS)
    ]


@double_precision
def discover(
    runs: Sequence[Run],
    *,
    hold_out: Sequence[str] = (),
    friction: Friction = "coulomb",
    effects: Sequence[str] = (),
    candidates: Sequence[str] | None = None,
    seed: int = 0,
    report: Report = lambda stage, done, total: None,
) -> Discovery:
    """Find what is missing from the model of these runs, which may have `effects` already.

    `hold_out` names runs that are predicted only, after their first part has told their own start.
    `candidates` are the catalogue's effects unless said. Raises MuscleBayesError for names that no
    run has, when no run is left to fit, and for runs that cannot be fitted together.
    """
    _check(runs, hold_out)
    names = applicable(runs, effects) if candidates is None else list(candidates)
    report("nominal model", 0, 1)
    with ThreadPoolExecutor(1) as pool:
        _begin_compiling(pool, runs, friction, effects, names)
        start = nominal(runs, friction, effects, seed, hold_out)
    whole, point = nest(start, names)
    held = tuple(hold_out)
    search = _Search(whole, whole, held, seed, report).over(whole)
    base = descend(search.train, tuple(effects), point)
    located = locate(search.train, base, seed)
    links, naming, stopped = _chain(search, base, names)
    last = links[-1].after if links else base
    left = located if not links else locate(search.train, last, seed)
    unknown = None
    if left.significant:
        unknown = _unknown(start, search, base, links)
    return _result(search, base, located, links, naming, left, unknown, stopped)


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
            raise MuscleBayesError(f"--hold-out {name}: no such run; there are: {', '.join(names)}")
    if set(names) <= set(hold_out):
        raise MuscleBayesError("every run is held out; leave at least one to fit")


def _chain(search: _Search, base: Fitted, names: Sequence[str]) -> tuple[list[_Link], Naming, str]:
    """Named effects, one after the other while readings not seen are predicted better by them.

    Also the first step's comparison, and why the chain ends.
    """
    current, remaining, links, first = base, list(names), list[_Link](), None
    while True:
        fits = fit_candidates(search.train, current, remaining, search.seed, search.report)
        lines = traces(search.train, current)
        naming = weigh(current, fits, blocks_of(lines, current.errors.size), search.seed)
        first = first or naming
        if not naming.claims:
            return links, first, "nothing significant that a named effect explains remains"
        effect = naming.best
        gate = _gate(search, current, fits[effect])
        if not gate.passed:
            reason = (
                f"{effect} would come next, but does not predict unseen readings better: "
                f"{gate.gain:+.1f} nat, standard error {gate.se:.1f}"
            )
            return links, first, reason
        rival = fits[naming.tie[1]] if naming.tie else None
        links.append(_Link(effect, naming, current, fits[effect], gate, rival))
        current = fits[effect]
        remaining.remove(effect)
        if len(links) == MOST:
            return links, first, f"{MOST} effects were added, which is the most"


def _gate(search: _Search, before: Fitted, after: Fitted) -> Gate:
    """By blocks of the fitted runs in turn, and by held-out runs where there are any."""
    lines = traces(search.train, before)
    blocks = blocks_of(lines, before.errors.size)
    gate = gate_by_blocks(search.train, before, after, blocks)
    if not search.held:
        return gate
    lines = traces(search.whole, before)
    blocks = blocks_of(lines, before.errors.size)
    return gate + gate_by_runs(search.whole, before, after, blocks, search.held, lines)


@dataclass(frozen=True)
class _Unknown:
    """What functions explain that named effects do not."""

    search: _Search
    """In the model that has functions."""
    alone: Fitted | None
    """The best function instead of every named effect."""
    link: _Link | None
    """The best function beside them; None if it is not worth having."""


def _unknown(start: Nominal, search: _Search, base: Fitted, links: Sequence[_Link]) -> _Unknown:
    """Functions on every port, beside the named effects and instead of them."""
    chain = [link.effect for link in links]
    last = links[-1].after if links else base
    whole, _ = nest(start, (*chain, *functions.ports(search.whole)))
    other = search.over(whole)
    lines = traces(search.train, last)
    names = functions.candidates(lines, functions.ports(search.whole))
    here = descend(other.train, last.effects, last.point)
    found = fit_candidates(other.train, here, names, search.seed, search.report)
    naming = weigh(here, found, blocks_of(lines, here.errors.size), search.seed)
    link = None
    if naming.claims:
        gate = _gate(other, here, found[naming.best])
        if gate.passed:
            link = _Link(naming.best, naming, here, found[naming.best], gate, None)
    alone = found.get(naming.best)
    if links:
        bare = descend(other.train, base.effects, base.point)
        instead = fit_candidates(other.train, bare, names, search.seed, search.report)
        alone = max(instead.values(), key=lambda one: one.log_evidence, default=None)
    return _Unknown(other, alone, link)


def _result(
    search: _Search,
    base: Fitted,
    located: MisfitMap,
    links: list[_Link],
    naming: Naming,
    left: MisfitMap,
    unknown: _Unknown | None,
    stopped: str,
) -> Discovery:
    last = links[-1].after if links else base
    odds = unexplained(left.p_value)
    if unknown is not None and unknown.alone is not None:
        odds = max(odds, float(np.exp(min(unknown.alone.log_evidence - last.log_evidence, 700.0))))
    probabilities = naming.with_unknown(odds)
    drop = bool(links) and probabilities[UNKNOWN] > probabilities[links[0].effect]
    if drop:
        links, stopped = [], "a function that nobody has named explains more than named effects"
    nominal_ = _judged(search, base, located)
    steps, before = [], nominal_
    for index, link in enumerate(links):
        misfit = left if index == len(links) - 1 else locate(search.train, link.after, search.seed)
        after = _judged(search, link.after, misfit)
        steps.append(_step(search, link, before, after))
        before = after
    if unknown is not None and unknown.link is not None and not drop:
        link = unknown.link
        misfit = locate(unknown.search.train, link.after, search.seed)
        steps.append(
            _step(unknown.search, link, before, _judged(unknown.search, link.after, misfit))
        )
        stopped = "what is left is described by a function, not named"
    verdict = _verdict(steps, left, drop)
    return Discovery(
        verdict=verdict,
        probabilities=probabilities,
        located=located,
        nominal=nominal_,
        steps=tuple(steps),
        held_out=search.held,
        floor=noise_floor(search.whole),
        next_experiment=_next(search, links),
        stopped_because=stopped,
        seed=search.seed,
    )


def _next(search: _Search, links: Sequence[_Link]) -> NextExperiment | None:
    """What would separate the first tie."""
    for link in links:
        if link.rival is not None:
            return propose(search.whole, link.after, link.rival)
    return None


def _verdict(steps: Sequence[Step], left: MisfitMap, dropped: bool) -> str | tuple[str, ...]:
    if not steps:
        return UNKNOWN if dropped or left.significant else NONE
    added = tuple(step.added for step in steps)
    return added[0] if len(added) == 1 else added


def _judged(search: _Search, fitted: Fitted, misfit: MisfitMap) -> Judged:
    found = {one.run: one for one in predictions(search.whole, fitted, search.seed)}
    for name in search.held:
        run = next(run for run in search.whole.problem.runs if run.name == name)
        found[name] = found[name]._replace(ahead_from=SETTLING_SHARE * run.duration)
    checks = {name: check_run(one) for name, one in found.items()}
    return Judged(fitted.effects, found, checks, misfit)


def _step(search: _Search, link: _Link, before: Judged, after: Judged) -> Step:
    unnamed = link.effect.startswith(f"{PREFIX}-")
    signals = (function_type(link.effect).signal,) if unnamed else ()
    return Step(
        added=UNKNOWN if unnamed else link.effect,
        effect=link.effect,
        port=effect_type(link.effect).port,
        signals=signals,
        probability=link.naming.probabilities[link.effect],
        tie=link.naming.tie,
        parameters=estimates(search.train, link.after, link.effect, search.seed),
        gate=link.gate,
        before=before,
        after=after,
        weakened=undetermined(search.train, link.before, link.after),
    )
