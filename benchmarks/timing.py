"""Timing of calls that are warm, each competitor's spread over the whole run."""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

ROUNDS = 3
SHARE = 1.0
"""Longest time that quick calls are repeated for in a round [s]; slow ones are called once."""


class Timing(NamedTuple):
    """Duration of a call [s]."""

    median: float
    low: float
    """Lower quartile."""
    high: float
    """Upper quartile."""
    calls: int


def seconds(call: Callable[[], object]) -> float:
    """How long one call takes."""
    begun = time.perf_counter()
    call()
    return time.perf_counter() - begun


def timings(calls: dict[str, Callable[[], object]]) -> dict[str, Timing]:
    """Each call's durations. Rounds go through all calls, so that disturbances meet all alike."""
    for call in calls.values():
        call()
    taken: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(ROUNDS):
        for name, call in calls.items():
            mine = [seconds(call)]
            while sum(mine) < SHARE:
                mine.append(seconds(call))
            taken[name] += mine
    result = {}
    for name, durations in taken.items():
        low, median, high = np.quantile(durations, (0.25, 0.5, 0.75))
        result[name] = Timing(float(median), float(low), float(high), len(durations))
    return result
