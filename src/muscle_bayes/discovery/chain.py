"""Named effects, one after the other, while each predicts unseen readings better."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from muscle_bayes.discovery.blocks import blocks_of, in_dispute, likeliest
from muscle_bayes.discovery.compare import compare
from muscle_bayes.discovery.conditions import traces
from muscle_bayes.discovery.explanation import Explanation
from muscle_bayes.discovery.gate import Gate, gate_by_blocks, gate_by_runs
from muscle_bayes.discovery.locate import locate
from muscle_bayes.discovery.naming import Naming, could_claim, weigh
from muscle_bayes.discovery.signatures import Regression, regression_on

MOST = 3
"""Effects that are added at most."""
NOTHING_LEFT = "nothing significant that a named effect explains remains"


@dataclass(frozen=True)
class Link:
    """An effect that was added to a chain."""

    effect: str
    naming: Naming
    before: Explanation
    after: Explanation
    gate: Gate
    rival: Explanation | None
    """The next likeliest of a tie."""


@dataclass(frozen=True)
class Chain:
    """Named effects that were added."""

    base: Explanation
    """The model without any of them, at the best point that was found."""
    links: tuple[Link, ...]
    naming: Naming
    """The first step's comparison."""
    regression: Regression
    """The same as a linear regression."""
    stopped: str
    """Why the chain ends."""

    @property
    def last(self) -> Explanation:
        """The model with all of them."""
        return self.links[-1].after if self.links else self.base


def chain(base: Explanation, names: Sequence[str]) -> Chain:
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
        search = current.search
        if links and not could_claim(locate(search.train, current.fitted, search.seed).p_value):
            return ended(NOTHING_LEFT)
        compared = compare(current, remaining)
        regression = regression or regression_on(compared.slow, compared.screened)
        current, fits = compared.base, compared.fits
        if links:
            links[-1] = replace(links[-1], after=current)
        search, best = current.search, current.fitted
        lines = traces(search.train, best)
        naming = weigh(
            best, fits, blocks_of(lines, in_dispute(best, likeliest(best, fits))), search.seed
        )
        naming = naming.supported(locate(search.train, best, search.seed).p_value)
        first = first or naming
        if not naming.claims:
            return ended(NOTHING_LEFT)
        effect = naming.best
        after = compared.found[effect]
        gate = judge(current, after)
        if not gate.passed:
            return ended(
                f"{effect} would come next, but does not predict unseen readings better: "
                f"{gate.gain:+.1f} nat, standard error {gate.se:.1f}"
            )
        rival = compared.found[naming.tie[1]] if naming.tie else None
        links.append(Link(effect, naming, current, after, gate, rival))
        current = after
        remaining.remove(effect)
        if len(links) == MOST:
            return ended(f"{MOST} effects were added, which is the most")


def judge(before: Explanation, after: Explanation) -> Gate:
    """By blocks of the fitted runs in turn, and by held-out runs where there are any."""
    search, disputed = before.search, in_dispute(before.fitted, after.fitted)
    blocks = blocks_of(traces(search.train, before.fitted), disputed)
    gate = gate_by_blocks(before, after, blocks)
    if not search.held:
        return gate
    lines = traces(search.whole, before.fitted)
    return gate.weighed_with(gate_by_runs(before, after, lines))
