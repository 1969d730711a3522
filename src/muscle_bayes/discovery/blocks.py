"""Blocks of readings that count as independent of each other."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int

from muscle_bayes.discovery.conditions import Trace
from muscle_bayes.inference.search.descent import Fitted

PARTS = 20
"""Parts of equal time into which every run is split."""
SHARE = 1.0 / PARTS
"""Of all that is in dispute: a block that holds more is halved."""


def in_dispute(one: Fitted, other: Fitted) -> Float[np.ndarray, " error"]:
    """How far two models differ in the log density of each reading [nat]."""
    return np.abs(one.log_densities - other.log_densities)


def likeliest(one: Fitted, others: Mapping[str, Fitted]) -> Fitted:
    """That of the highest evidence."""
    return max([one, *others.values()], key=lambda fitted: fitted.log_evidence)


def blocks_of(
    lines: Sequence[Trace], disputed: Float[np.ndarray, " error"]
) -> Int[np.ndarray, " error"]:
    """Number of the block in which each reading lies, in order of time; -1 where nothing is observed.

    No block of several readings holds more than SHARE of what two models dispute over all of `lines`. In
    blocks of equal time an effect that acts for some seconds would stand or fall with one of them, and
    nothing would be left to tell it from while that is left out. What is disputed are densities of
    readings given those before, so neighbours count as independent. But for those of a segment, which
    are known together only, its start being integrated out: no block holds a part of one.
    """
    found = np.full(disputed.size, -1)
    most = SHARE * sum(float(disputed[line.place].sum()) for line in lines)
    number = 0
    for line in lines:
        edges = np.linspace(line.time[0], line.time[-1], PARTS + 1)
        begins = np.flatnonzero(np.diff(line.segment, prepend=-1) != 0)
        cuts = np.append(begins, line.time.size)[
            np.searchsorted(begins, np.searchsorted(line.time, edges[1:-1]))
        ]
        for part in np.split(np.arange(line.time.size), cuts):
            for block in _halved(part, disputed[line.place], line.segment, most):
                found[line.place[block]] = number
                number += 1
    return found


def _halved(
    block: Int[np.ndarray, " reading"],
    disputed: Float[np.ndarray, " interval"],
    segment: Int[np.ndarray, " interval"],
    most: float,
) -> list[Int[np.ndarray, " reading"]]:
    cuts = 1 + np.flatnonzero(np.diff(segment[block]))
    if not cuts.size or disputed[block].sum() <= most:
        return [block]
    middle = cuts[np.argmin(np.abs(cuts - block.size // 2))]
    return [
        half
        for part in (block[:middle], block[middle:])
        for half in _halved(part, disputed, segment, most)
    ]
