"""Progress of long computations: bars in a terminal and in Jupyter, else plain lines."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from time import monotonic

Report = Callable[[str, int, int], None]
"""Called with a stage, how much of it is done, and how much there is in all.

What follows "; " in the stage is a note that may change, such as "sampling; 2 divergences".
"""


def silent(stage: str, done: int, total: int) -> None:
    """Report to nobody."""


INTERVAL = 10.0
"""Least time between two lines on one stage, s."""
COUNTED = {"searching": "starts", "sampling": "draws of each chain"}
"""What is counted in a stage."""


@contextmanager
def shown_progress(shown: bool = True) -> Iterator[Report]:
    """Show each stage, how much of it is done and the time to go, on stderr.

    Args:
        shown: whether to show anything.

    Yields:
        The function to report to: `report(stage, done, total)`.

    Example:
        >>> from muscle_bayes.progress import shown_progress
        >>> with shown_progress(False) as report:
        ...     report("sampling; no divergences", 100, 400)
    """
    if not shown:
        yield silent
        return
    from rich.console import Console

    console = Console(stderr=True, emoji=False, highlight=False)
    if find_spec("ipywidgets") if console.is_jupyter else console.is_terminal:
        with _bars(console) as report:
            yield report
    else:
        # In Jupyter, stderr is shown as if something were wrong.
        yield _Lines(sys.stdout if console.is_jupyter else sys.stderr)


def shares(report: Report, stage: str) -> Callable[[float], None]:
    """A function that takes the share of a stage that is done, and reports it in percent."""
    return lambda share: report(f"{stage} (%)", round(100.0 * share), 100)


@contextmanager
def _bars(console) -> Iterator[Report]:
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TaskID,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("to go"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}"),
    )
    with Progress(*columns, console=console) as bars:
        tasks: dict[str, TaskID] = {}

        def report(what: str, done: int, total: int) -> None:
            stage, _, note = what.partition("; ")
            if stage not in tasks:
                tasks[stage] = bars.add_task(_named(stage), total=total, note=note)
            bars.update(tasks[stage], completed=done, total=total, note=note)

        yield report


class _Lines:
    """A line at the start and the end of a stage, and every INTERVAL between."""

    def __init__(self, out) -> None:
        self._out = out
        self._stage, self._begun, self._last = "", 0.0, 0.0
        self._paced: tuple[int, float] | None = None
        self._done = 0

    def __call__(self, what: str, done: int, total: int) -> None:
        now = monotonic()
        stage, _, note = what.partition("; ")
        if stage != self._stage:
            self._stage, self._begun, self._paced = stage, now, None
        elif done < total and now - self._last < INTERVAL:
            return
        self._last = now
        if done and (self._paced is None or done < self._done):  # before it may be compilation
            self._paced = done, now
        self._done = done
        told = [f"{_named(stage)}: {done} of {total}", note, self._time(done, total)]
        print(", ".join(filter(None, told)), file=self._out, flush=True)

    def _time(self, done: int, total: int) -> str:
        now = monotonic()
        if done >= total:
            return f"{now - self._begun:.0f} s"
        first, since = self._paced or (done, now)
        if done == first:
            return ""
        return f"about {(now - since) * (total - done) / (done - first):.0f} s to go"


def _named(stage: str) -> str:
    """The stage with what is counted in it."""
    return f"{stage} ({COUNTED[stage]})" if stage in COUNTED else stage
