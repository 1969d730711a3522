"""What functions that nobody has named explain beside named effects, or instead of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from muscle_bayes.discovery import functions
from muscle_bayes.discovery.chain import Chain, Link, Search, judge
from muscle_bayes.discovery.conditions import traces
from muscle_bayes.discovery.naming import PRIOR_UNKNOWN, blocks_of, weigh
from muscle_bayes.discovery.nominal import Nominal, nest
from muscle_bayes.discovery.search import fit_candidates, screen
from muscle_bayes.inference.descent import Fitted, descend


@dataclass(frozen=True)
class Unknown:
    """What functions explain that named effects do not; None where they are not worth having."""

    search: Search
    """In the model that has functions."""
    beside: Link | None
    """The best function beside the named effects."""
    instead: Link | None
    """The best function without any of them."""

    def replaces(self, last: Fitted) -> bool:
        """Whether a function alone is likelier than named effects, helped or not."""
        best = last if self.beside is None else self.beside.after
        if self.instead is None:
            return False
        lead = self.instead.after.log_evidence - best.log_evidence
        return lead > math.log((1.0 - PRIOR_UNKNOWN) / PRIOR_UNKNOWN)

    def odds(self, last: Fitted) -> float:
        """Evidence of a function alone against that of the named effects, at least even."""
        if self.instead is None:
            return 1.0
        lead = self.instead.after.log_evidence - last.log_evidence
        return float(np.exp(np.clip(lead, 0.0, 700.0)))


def search_functions(start: Nominal, search: Search, named: Chain) -> Unknown:
    """Functions on every port, beside the named effects and instead of them."""
    ports = functions.ports(search.whole)
    whole, _ = nest(start, (*(link.effect for link in named.links), *ports))
    other = search.over(whole)
    names = functions.candidates(traces(search.train, named.last), ports)
    beside = _function(other, named.last, names)
    return Unknown(other, beside, _function(other, named.base, names) if named.links else beside)


def _function(search: Search, before: Fitted, names: Sequence[str]) -> Link | None:
    """The best function beside `before`, if it is claimed and predicts unseen readings better."""
    here = descend(search.train, before.effects, before.point)
    screened = screen(search.train, here, names, search.seed)
    found = fit_candidates(search.train, here, screened, search.report)
    if not found:
        return None
    lines = traces(search.train, here)
    naming = weigh(here, found, blocks_of(lines, here.errors.size), search.seed)
    if not naming.claims:
        return None
    gate = judge(search, here, found[naming.best])
    link = Link(naming.best, naming, here, found[naming.best], gate, None)
    return link if gate.passed else None
