"""The rules by which a log's time column is made to rise."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from muscle_bayes.data.repairing.ledger import Floats, Ledger, Repair

RESTART: Final = 1.0
"""Backward jump from which a log is taken for restarted, s."""
GAP: Final = 20.0
"""A gap is a spacing of more than this many median spacings."""
_MOST_BACK: Final = 0.05
"""Share of rows that jump back above which the time column does not rise at all."""
_BLOCK: Final = 100
"""Rows within which the forward jump that belongs to a backward one is sought."""


def refuse_falling_time(ledger: Ledger) -> None:
    """A time column that goes back again and again is no clock (LabVIEW's bursts, a scope's sweeps).

    Raises RunError, which offers a fixed rate.
    """
    time = ledger.columns["time"]
    back = np.flatnonzero(np.diff(time) < 0) + 1
    if back.size > max(2.0, 0.9 * time.size):
        raise ledger.refusal(
            f"the time column falls, from {time[0]:.6g} to {time[-1]:.6g} s: the newest row is first",
            "sort the rows by time",
            back[0],
            "time",
        )
    if back.size > max(2.0, _MOST_BACK * time.size):
        row = back[0]
        raise ledger.refusal(
            f"the time column does not rise: it goes back in {back.size} of {time.size} rows, first "
            f"from {time[row - 1]:.6g} to {time[row]:.6g} s",
            "where rows are evenly spaced, give their rate as sample_rate (rows per second) in "
            "[log]; else export a time that runs on",
            row,
            "time",
            "log.sample_rate",
        )


def drop_duplicates(ledger: Ledger) -> None:
    """Rows with the time stamp of the row before: the first is kept.

    Raises RunError where stamps are so coarse that most rows share one.
    """
    time = ledger.columns["time"]
    same = np.diff(time, prepend=np.nan) == 0
    if same.sum() > 0.3 * same.size:
        raise ledger.refusal(
            f"{int(same.sum())} of {same.size} rows have the time stamp of the row before: stamps "
            f"are {median_spacing(time):.4g} s apart, coarser than rows",
            "export finer times, or give the rows' rate as sample_rate (rows per second) in [log]",
            same,
            "time",
            "log.sample_rate",
        )
    ledger.record("duplicate time", same, "time stamp of the row before: the first row kept")
    ledger.drop(same)


def undo_backward_jumps(ledger: Ledger) -> None:
    """Make time rise where it jumps back by less than RESTART.

    A backward jump that undoes a forward one near by means that the block of rows between them was
    stamped late (or early): that block alone is shifted, so that the spacings at its two ends come
    out equal, and the clock of all other rows stands. A backward jump without such a partner means
    that the clock was set back: all later rows are shifted so that time goes on by the median
    spacing. Raises RunError where the log was restarted.
    """
    time = ledger.columns["time"].copy()
    back = np.flatnonzero(np.diff(time) < 0) + 1
    if not back.size:
        return
    _refuse_restart(ledger, time, back)
    median = median_spacing(time)
    blocks: list[int] = []
    shifts: list[int] = []
    for row in map(int, back):
        if time[row] > time[row - 1]:  # undone together with the jump before
            continue
        if (block := _displaced_block(time, row, median)) is not None:
            time[slice(*block[:2])] += block[2]
            blocks.append(row)
        else:
            time[row:] += time[row - 1] + median - time[row]
            shifts.append(row)
    ledger.columns["time"] = time
    note = "time jumps back: the block of rows stamped late or early was shifted into place"
    _report(ledger, blocks, "displaced block", note)
    note = f"time jumps back: later rows shifted to go on by the median spacing, {median:.4g} s"
    _report(ledger, shifts, "clock set back", note)


def gaps(time: Floats) -> list[tuple[float, float]]:
    """Start and end of each spacing of more than GAP median spacings, in the unit of `time`."""
    spacing = np.diff(time)
    if not spacing.size:
        return []
    at = np.flatnonzero(spacing > GAP * median_spacing(time))
    return [(float(time[i]), float(time[i + 1])) for i in at]


def report_gaps(ledger: Ledger) -> None:
    """Report gaps; nothing is filled."""
    time = ledger.columns["time"]
    long_gaps = gaps(time)
    if not long_gaps:
        return
    row = int(ledger.lines[np.searchsorted(time, long_gaps[0][1])])
    longest = max(end - start for start, end in long_gaps)
    note = f"spacings of more than {GAP:g} medians, the longest {longest:.4g} s: not filled"
    ledger.repairs.append(Repair("gap", len(long_gaps), row, note))


def median_spacing(time: Floats) -> float:
    """Usual distance of rows, in the unit of `time`; 0 where none rises."""
    spacing = np.diff(time)
    rising = spacing[spacing > 0]
    return float(np.median(rising)) if rising.size else 0.0


def _displaced_block(time: Floats, row: int, median: float) -> tuple[int, int, float] | None:
    """First row, end and shift of the block whose displacement ends or begins at `row`, if any.

    A forward jump is the partner where, with the backward one, it leaves two ordinary spacings.
    """
    back = time[row] - time[row - 1]
    before = np.diff(time[max(row - 1 - _BLOCK, 0) : row])
    late = np.flatnonzero((before + back > 0) & (before + back < 3 * median))
    if late.size:
        first = row - before.size + int(late[-1])
        return first, row, -float(before[late[-1]] - back) / 2
    after = np.diff(time[row : row + 1 + _BLOCK])
    early = np.flatnonzero((after + back > 0) & (after + back < 3 * median))
    if early.size:
        end = row + int(early[0]) + 1
        return row, end, float(after[early[0]] - back) / 2
    return None


def _refuse_restart(ledger: Ledger, time: Floats, back: NDArray[np.intp]) -> None:
    restarts = back[time[back - 1] - time[back] >= RESTART]
    if restarts.size:
        row = restarts[0]
        raise ledger.refusal(
            f"time jumps back by {time[row - 1] - time[row]:.6g} s, the log was restarted there",
            "make a run of each part, or remove the row before if its time stamp is wrong",
            row,
            "time",
        )


def _report(ledger: Ledger, rows: list[int], rule: str, note: str) -> None:
    mask = np.zeros(ledger.lines.size, dtype=bool)
    mask[rows] = True
    ledger.record(rule, mask, note)
