"""How readings are split into blocks."""

from dataclasses import replace

import numpy as np

from muscle_bayes.discovery.conditions import Trace
from muscle_bayes.discovery.weigh import blocks_of


def _line(run: str, time: np.ndarray, first: int) -> Trace:
    place = first + np.arange(time.size)
    ones = np.ones(time.size)
    return Trace(run, "counts", time, ones, 0.0 * ones, place, place, {})


PARTS = 20
SHARE = 1.0 / PARTS
LINES = [_line("a", np.linspace(0.0, 400.0, 401), 0), _line("b", np.linspace(0.0, 8.0, 81), 420)]
SEEN = np.r_[0:401, 420:501]


def test_blocks_are_parts_of_equal_time_where_the_dispute_is_everywhere() -> None:
    found = blocks_of(LINES, np.ones(510))
    assert np.unique(found[:401]).size == PARTS
    assert np.unique(found[420:501]).size == PARTS
    assert np.all(np.bincount(found[:401]) >= 20)
    assert np.all(np.delete(found, SEEN) == -1)


def test_a_dispute_about_some_seconds_is_split_among_blocks_of_its_own() -> None:
    disputed = np.full(510, 1e-3)
    disputed[31:49] = 2.0
    found = blocks_of(LINES, disputed)
    inside = found[found >= 0]
    held = np.bincount(inside, weights=disputed[found >= 0])
    sizes = np.bincount(inside)
    assert np.all((held <= SHARE * disputed[SEEN].sum()) | (sizes == 1))
    assert np.unique(found[31:49]).size >= 18
    assert np.all(np.diff(found[SEEN]) >= 0)
    assert np.unique(found[420:501]).size == PARTS


def test_nothing_is_split_where_nothing_is_disputed() -> None:
    assert np.unique(blocks_of(LINES, np.zeros(510))).size == 2 * PARTS + 1


def test_no_segment_is_split() -> None:
    """Ten readings each: too few segments for the parts of one run, and a dispute within one of them."""
    cut = [replace(line, segment=line.place // 10) for line in LINES]
    disputed = np.full(510, 1e-3)
    disputed[31:49] = 2.0
    found = blocks_of(cut, disputed)
    for line in cut:
        for segment in np.unique(line.segment):
            inside = line.place[line.segment == segment]
            assert np.unique(found[inside]).size == 1
    assert np.unique(found[30:50]).size == 2
    assert np.unique(found[420:501]).size == 9
    assert np.all(np.diff(found[SEEN]) >= 0)
