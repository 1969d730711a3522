"""Failed readings that look like numbers, found from the signal's own rate of change."""

from typing import Final

import numpy as np

from muscle_bayes.data.repairing.ledger import Floats, Mask

_FASTER: Final = 5.0
"""A failed reading jumps by more than this many of the largest steps that the signal else makes."""
_FASTER_TO_FAILURE: Final = 2.5
"""The same where it jumps to a value that failed sensors are known to show."""
_FASTER_FOR_LONG: Final = 10.0
"""The same where the value stands for more rows than a single reading does."""
_RETURNS: Final = 0.4
"""The signal comes back to where it was within this share of the jump."""
_LONGEST: Final = 3
"""A failed reading is repeated for at most this many rows, or as often as readings are repeated."""
_REPEATED: Final = 40
"""Most rows for which a slow sensor's reading is taken to be repeated."""
_FEWEST: Final = 10
"""Rows from which a signal shows how fast it changes."""
_AROUND: Final = 3
"""Readings before and after one, whose median tells where the signal is."""
_FROZEN: Final = 20
"""A frozen value lasts this many times longer than values else do."""


def find_jumps(values: Floats, floor: float = 0.0, failures: tuple[float, ...] = ()) -> Mask:
    """Rows that jump away and back at once, by far more than the signal else changes between rows.

    A value that a slow sensor repeats counts once. A step that does not come back is no fault, nor
    are jumps as frequent as those of the signal itself.

    Args:
        values: finite readings, shape (rows,).
        floor: change between readings that is ordinary in any case, in the unit of `values`.
        failures: values that failed sensors show.

    Returns:
        Mask, shape (rows,).
    """
    mask = np.zeros(values.size, dtype=bool)
    starts = np.flatnonzero(np.r_[True, np.diff(values) != 0]) if values.size else np.zeros(0, int)
    if values.size < _FEWEST or starts.size < 3:
        return mask
    level, ends = values[starts], np.r_[starts[1:], values.size]
    length = ends - starts
    longest = max(_LONGEST, min(2 * int(np.median(length)), _REPEATED))
    with np.errstate(over="ignore", invalid="ignore"):
        step = np.diff(level)
        out, back = step[:-1], step[1:]
        least = np.minimum(np.abs(out), np.abs(back))
        spike = (out * back < 0) & (np.abs(out + back) <= _RETURNS * least)
        spike &= length[1:-1] <= _REPEATED
        spike &= np.isfinite(least)
    if not spike.any():
        return mask
    # The signal's own largest step: without the steps into and out of what may be a failure. Noise
    # makes small spikes all the time, so those below the largest step count as the signal's own.
    size = np.zeros(step.size)
    size[:-1][spike] = least[spike]
    size[1:][spike] = np.maximum(size[1:][spike], least[spike])
    others = np.abs(step[size == 0])
    own = max(float(others.max()) if others.size else 0.0, floor, _resolution(level))
    own = _with_noise(own, np.sort(least[spike]))
    if own == 0.0:
        return mask
    known = np.isin(level[1:-1], failures)
    faster = np.where(known, _FASTER_TO_FAILURE, _FASTER)
    faster = np.where(length[1:-1] > longest, _FASTER_FOR_LONG, faster)
    wild = spike & (least > faster * own)
    for at in np.flatnonzero(wild) + 1:
        # Between two failed readings a sound one jumps and comes back too: it is near its neighbours.
        near = np.median(level[max(at - _AROUND, 0) : at + _AROUND + 1])
        if abs(level[at] - near) > 0.5 * least[at - 1]:
            mask[starts[at] : ends[at]] = True
    return mask


def find_frozen(values: Floats, floor: float = 0.0) -> Mask:
    """Rows whose value stood still far longer than values else do, and then jumped.

    Args:
        values: finite readings, shape (rows,).
        floor: change between readings that is ordinary in any case, in the unit of `values`.

    Returns:
        Mask, shape (rows,).
    """
    mask = np.zeros(values.size, dtype=bool)
    starts = np.flatnonzero(np.r_[True, np.diff(values) != 0]) if values.size else np.zeros(0, int)
    if starts.size < _FEWEST:
        return mask
    ends = np.r_[starts[1:], values.size]
    length = ends - starts
    with np.errstate(over="ignore"):
        step = np.abs(np.diff(values[starts]))
    long = np.flatnonzero(length[:-1] > _FROZEN * max(1.0, float(np.median(length))))
    others = np.delete(step, long)
    own = max(float(others.max()) if others.size else 0.0, floor)
    for at in long[step[long] > _FASTER * own]:
        mask[starts[at] + 1 : ends[at]] = True
    return mask


def _resolution(level: Floats) -> float:
    """Smallest distance between different values."""
    steps = np.diff(np.unique(level))
    return float(steps.min()) if steps.size else 0.0


def _with_noise(own: float, spikes: Floats) -> float:
    """The signal's own largest step, its noise included.

    Spikes, from the smallest, belong to the noise as long as each is at most twice the largest step
    so far: an outlier stands apart from them.
    """
    for size in spikes:
        if size > 2.0 * own:
            break
        own = max(own, float(size))
    return own
