"""Rows whose temperatures are out of step with their angles."""

from bisect import bisect_right
from collections.abc import Sequence

from muscle_bayes.twin.sensors import Update

Row = tuple[float, float, float, int, float, float, int, int, int]
"""Values of the log's columns, in their order."""


def logged_late(
    rows: Sequence[Row], updates: Sequence[Update], origin: float, delay: float
) -> list[Row]:
    """The rows with what the meter showed `delay` [s] before each, or after it where negative.

    `origin` is the time of the first row [s]. Before its first update the meter shows that.
    """
    times = [time for time, _ in updates]
    result, seen = [], None
    for row in rows:
        number = max(bisect_right(times, origin + row[0] - delay) - 1, 0)
        first, second = updates[number][1]
        at, _, aim_a, stable_a, _, aim_b, stable_b, _, counts = row
        fresh = int(number != seen)
        result.append((at, first, aim_a, stable_a, second, aim_b, stable_b, fresh, counts))
        seen = number
    return result
