"""Candidates searched in slow motion alone, each judged with its own motion."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from muscle_bayes.discovery.explanation import Explanation, Search
from muscle_bayes.discovery.screen import Start
from muscle_bayes.discovery.search import OUT_OF_REACH, search_candidates
from muscle_bayes.inference.running.side_by_side import side_by_side
from muscle_bayes.inference.search.descent import Fitted, descend

MOST_SETTLED = 4
"""Candidates that get their own motion, and more where one without it would be likelier than those."""


class Compared(NamedTuple):
    """Candidates, and the model without them, each with its own motion."""

    base: Explanation
    slow: Fitted
    """The model without candidates in slow motion alone, which starts were screened beside."""
    screened: Mapping[str, Sequence[Start]]
    found: Mapping[str, Explanation]

    @property
    def fits(self) -> dict[str, Fitted]:
        """The candidates' fits."""
        return {name: one.fitted for name, one in self.found.items()}


def compare(base: Explanation, names: Sequence[str]) -> Compared:
    """Candidates beside `base`, or beside what they led to without themselves where that is likelier.

    What inertia adds to the slow motion of `base` is its own: a model that moves otherwise would be
    held against readings less the swings of a wrong one, and a descent led away from the truth. So
    candidates are searched without it, and what each adds for itself is added afterwards.
    """
    search = base.search.without_swings()
    begun = descend(search.train, base.fitted.effects, base.fitted.point)
    searched = search_candidates(
        search.train, begun, names, search.seed, search.report, search.workers
    )
    base = likelier(base, Explanation(search, searched.base).settled())
    return Compared(
        base=base,
        slow=searched.base,
        screened=searched.screened,
        found=with_own_motion(search, searched.fits, base),
    )


def likelier(one: Explanation, other: Explanation) -> Explanation:
    """The explanation of the higher evidence; the first of two alike."""
    return max(one, other, key=_evidence)


def _evidence(one: Explanation) -> float:
    return one.fitted.log_evidence


def with_own_motion(
    search: Search, fits: Mapping[str, Fitted], base: Explanation
) -> dict[str, Explanation]:
    """Candidates found in slow motion alone: the likeliest, each settled with its own motion.

    At most MOST_SETTLED of them, none OUT_OF_REACH behind the best; the others are fitted with the motion
    of `base`, and settled only while one of them would be likelier than all.
    """
    order = sorted(fits, key=lambda name: -fits[name].log_evidence)
    near = [
        name
        for name in order[:MOST_SETTLED]
        if fits[name].log_evidence >= fits[order[0]].log_evidence - OUT_OF_REACH
    ]

    def settled(name: str) -> Explanation:
        return Explanation(search, fits[name]).settled()

    def beside(name: str) -> Explanation:
        fitted = descend(base.search.train, fits[name].effects, fits[name].point)
        return Explanation(base.search, fitted)

    far = [name for name in order if name not in near]
    found = dict(zip(near, side_by_side(settled, near, search.workers), strict=True))
    found |= dict(zip(far, side_by_side(beside, far, search.workers), strict=True))
    while far and (best := max(found, key=lambda name: _evidence(found[name]))) in far:
        far.remove(best)
        found[best] = found[best].settled()
    return {name: found[name] for name in fits}
