"""Named effects, one after the other, while each predicts unseen readings better."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from muscle_bayes.discovery.conditions import traces
from muscle_bayes.discovery.gate import Gate, gate_by_blocks, gate_by_runs
from muscle_bayes.discovery.holding import without_runs
from muscle_bayes.discovery.naming import Naming, blocks_of, weigh
from muscle_bayes.discovery.search import fit_candidates
from muscle_bayes.inference.descent import Fitted
from muscle_bayes.inference.nested import Nested

MOST = 3
"""Effects that are added at most."""

Report = Callable[[str, int, int], None]


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


def chain(search: Search, base: Fitted, names: Sequence[str]) -> tuple[list[Link], Naming, str]:
    """Named effects, one after the other while readings not seen are predicted better by them.

    Also the first step's comparison, and why the chain ends.
    """
    current, remaining, links, first = base, list(names), list[Link](), None
    while True:
        fits = fit_candidates(search.train, current, remaining, search.seed, search.report)
        lines = traces(search.train, current)
        naming = weigh(current, fits, blocks_of(lines, current.errors.size), search.seed)
        first = first or naming
        if not naming.claims:
            return links, first, "nothing significant that a named effect explains remains"
        effect = naming.best
        gate = judge(search, current, fits[effect])
        if not gate.passed:
            reason = (
                f"{effect} would come next, but does not predict unseen readings better: "
                f"{gate.gain:+.1f} nat, standard error {gate.se:.1f}"
            )
            return links, first, reason
        rival = fits[naming.tie[1]] if naming.tie else None
        links.append(Link(effect, naming, current, fits[effect], gate, rival))
        current = fits[effect]
        remaining.remove(effect)
        if len(links) == MOST:
            return links, first, f"{MOST} effects were added, which is the most"


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
