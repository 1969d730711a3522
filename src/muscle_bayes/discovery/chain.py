"""Named effects, one after the other, while each predicts unseen readings better."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from muscle_bayes.discovery.conditions import traces
from muscle_bayes.discovery.gate import Gate, gate_by_blocks, gate_by_runs
from muscle_bayes.discovery.holding import without_runs
from muscle_bayes.discovery.locate import locate
from muscle_bayes.discovery.naming import Naming, blocks_of, weigh
from muscle_bayes.discovery.search import Report, fit_candidates, screen, without_last
from muscle_bayes.discovery.signatures import Regression, regression_on
from muscle_bayes.inference.descent import Fitted
from muscle_bayes.inference.nested import Nested

MOST = 3
"""Effects that are added at most."""


@dataclass(frozen=True)
class Search:
    """What every step needs."""

    whole: Nested
    train: Nested
    """The same, held-out runs known by their starts only."""
    held: tuple[str, ...]
    seed: int
    report: Report

    def over(self, nested: Nested) -> "Search":
        """The same search in another nested model."""
        return replace(self, whole=nested, train=nested.on(without_runs(nested.problem, self.held)))


@dataclass(frozen=True)
class Link:
    """An effect that was added to a chain."""

    effect: str
    naming: Naming
    before: Fitted
    after: Fitted
    gate: Gate
    rival: Fitted | None
    """The next likeliest of a tie."""


@dataclass(frozen=True)
class Chain:
    """Named effects that were added."""

    base: Fitted
    """The model without any of them, at the best point that was found."""
    links: tuple[Link, ...]
    naming: Naming
    """The first step's comparison."""
    regression: Regression
    """The same as a linear regression."""
    stopped: str
    """Why the chain ends."""

    @property
    def last(self) -> Fitted:
        """The model with all of them."""
        return self.links[-1].after if self.links else self.base


def chain(search: Search, base: Fitted, names: Sequence[str]) -> Chain:
    """Named effects, one after the other while readings not seen are predicted better by them."""
    current, remaining, links = base, list(names), list[Link]()
    first: Naming | None = None
    regression: Regression | None = None

    def ended(reason: str) -> Chain:
        assert first is not None
        assert regression is not None
        without = links[0].before if links else current
        return Chain(without, tuple(links), first, regression, reason)

    while True:
        screened = screen(search.train, current, remaining, search.seed)
        regression = regression or regression_on(current, screened)
        fits = fit_candidates(search.train, current, screened, search.report)
        current = without_last(search.train, list(fits.values()), current)
        if links:
            links[-1] = replace(links[-1], after=current)
        lines = traces(search.train, current)
        naming = weigh(current, fits, blocks_of(lines, current.errors.size), search.seed)
        naming = naming.supported(locate(search.train, current, search.seed).p_value)
        first = first or naming
        if not naming.claims:
            return ended("nothing significant that a named effect explains remains")
        effect = naming.best
        gate = judge(search, current, fits[effect])
        if not gate.passed:
            return ended(
                f"{effect} would come next, but does not predict unseen readings better: "
                f"{gate.gain:+.1f} nat, standard error {gate.se:.1f}"
            )
        rival = fits[naming.tie[1]] if naming.tie else None
        links.append(Link(effect, naming, current, fits[effect], gate, rival))
        current = fits[effect]
        remaining.remove(effect)
        if len(links) == MOST:
            return ended(f"{MOST} effects were added, which is the most")


def judge(search: Search, before: Fitted, after: Fitted) -> Gate:
    """By blocks of the fitted runs in turn, and by held-out runs where there are any."""
    lines = traces(search.train, before)
    blocks = blocks_of(lines, before.errors.size)
    gate = gate_by_blocks(search.train, before, after, blocks)
    if not search.held:
        return gate
    lines = traces(search.whole, before)
    blocks = blocks_of(lines, before.errors.size)
    return gate.weighed_with(gate_by_runs(search.whole, before, after, blocks, search.held, lines))
