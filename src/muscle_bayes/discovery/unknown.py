"""What functions that nobody has named explain beside named effects, or instead of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from muscle_bayes.discovery import functions
from muscle_bayes.discovery.blocks import blocks_of, in_dispute, likeliest
from muscle_bayes.discovery.chain import Chain, Link, judge
from muscle_bayes.discovery.compare import likelier, with_own_motion
from muscle_bayes.discovery.conditions import traces
from muscle_bayes.discovery.explanation import Explanation
from muscle_bayes.discovery.locate import locate
from muscle_bayes.discovery.naming import PRIOR_UNKNOWN, weigh
from muscle_bayes.discovery.nominal import Nominal, nest
from muscle_bayes.discovery.search import fit_candidates, screen, searched_further
from muscle_bayes.inference.search.descent import descend


@dataclass(frozen=True)
class Unknown:
    """What functions explain that named effects do not; None where they are not worth having."""

    named: Explanation
    """The final model of named effects alone."""
    beside: Link | None
    """The best function beside the named effects; `instead` where there are none."""
    instead: Link | None
    """The best function without any of them."""

    @cached_property
    def odds(self) -> float:
        """Evidence of a function alone against that of the named effects, at least even.

        A function that helps the named effects counts for them only if they would be added beside one as
        beside any other model: they may owe all they explain to what no function can follow exactly.
        """
        if self.instead is None:
            return 1.0
        best, helped = self.named, self.beside
        if helped is not None and helped is not self.instead:
            best = helped.after if _adds(self.instead.after, helped.after) else best
        lead = self.instead.after.fitted.log_evidence - best.fitted.log_evidence
        return float(np.exp(np.clip(lead, 0.0, 700.0)))

    @property
    def replaces(self) -> bool:
        """Whether a function alone is likelier than the named effects."""
        return self.odds > (1.0 - PRIOR_UNKNOWN) / PRIOR_UNKNOWN


def _adds(before: Explanation, after: Explanation) -> bool:
    """Whether what `after` has more than `before` is claimed, and predicts unseen readings better."""
    search, best, rival = before.search, before.fitted, after.fitted
    blocks = blocks_of(traces(search.train, best), in_dispute(best, rival))
    naming = weigh(best, {"more": rival}, blocks, search.seed)
    left = locate(search.train, best, search.seed)
    return naming.supported(left.p_value).claims and judge(before, after).passed


def search_functions(start: Nominal, named: Chain) -> Unknown:
    """Functions on every port, beside the named effects and instead of them."""
    search = named.base.search
    ports = functions.ports(search.whole)
    effects = tuple(link.effect for link in named.links)
    names = functions.candidates(traces(search.train, named.last.fitted), ports)

    def found(beside: Explanation) -> Link | None:
        lanes = beside.search.whole.data.lanes
        problem = replace(start.problem, data=start.problem.data._replace(lanes=lanes))
        whole, _ = nest(start._replace(problem=problem), (*effects, *ports))
        return _function(replace(beside, search=search.over(whole)), names)

    beside = found(named.last)
    return Unknown(named.last, beside, found(named.base) if named.links else beside)


def _function(before: Explanation, names: Sequence[str]) -> Link | None:
    """The best function beside `before`, if it is claimed and predicts unseen readings better."""
    slow = before.search.without_swings()
    here = descend(slow.train, before.fitted.effects, before.fitted.point)
    screened = screen(slow.train, here, names, slow.seed, slow.workers)
    searched = fit_candidates(slow.train, here, screened, slow.seed, slow.report, slow.workers)
    if not searched:
        return None
    searched = searched_further(slow.train, here, searched, slow.seed, slow.workers)
    known = descend(before.search.train, before.fitted.effects, before.fitted.point)
    before = likelier(Explanation(before.search, known), Explanation(slow, here).settled())
    found = with_own_motion(slow, searched, before)
    fits = {name: one.fitted for name, one in found.items()}
    search, best = before.search, before.fitted
    lines = traces(search.train, best)
    blocks = blocks_of(lines, in_dispute(best, likeliest(best, fits)))
    naming = weigh(best, fits, blocks, search.seed)
    if not naming.claims:
        return None
    after = found[naming.best]
    link = Link(naming.best, naming, before, after, judge(before, after), None)
    return link if link.gate.passed else None
