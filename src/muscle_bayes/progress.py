"""Progress of long computations that are called from Python."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from time import monotonic

Report = Callable[[str, int, int], None]
"""Called with a stage's name, how much of it is done, and how much there is in all."""

INTERVAL = 10.0
"""Least time between two lines on one stage, s."""


@contextmanager
def shown_progress(shown: bool = True) -> Iterator[Report]:
    """Show each stage, how much of it is done and the time to go, on stderr.

    Bars in a terminal and in Jupyter with ipywidgets, else lines of text.

    Args:
        shown: whether to show anything.

    Yields:
        The function to report to: `report(stage, done, total)`.
    """
    if not shown:
        yield lambda stage, done, total: None
        return
    from rich.console import Console

    console = Console(stderr=True, emoji=False, highlight=False)
    if find_spec("ipywidgets") if console.is_jupyter else console.is_terminal:
        with _bars(console) as report:
            yield report
    else:
        # In Jupyter, stderr is shown as if something were wrong.
        yield _Lines(sys.stdout if console.is_jupyter else sys.stderr)


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
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("to go"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console) as bars:
        tasks: dict[str, TaskID] = {}

        def report(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(_named(stage), total=total)
            bars.update(tasks[stage], completed=done, total=total)

        yield report


class _Lines:
    """A line at the start and the end of a stage, and every INTERVAL between."""

    def __init__(self, out) -> None:
        self._out = out
        self._stage, self._begun, self._last = "", 0.0, 0.0

    def __call__(self, stage: str, done: int, total: int) -> None:
        now = monotonic()
        if stage != self._stage:
            self._stage, self._begun = stage, now
        elif done < total and now - self._last < INTERVAL:
            return
        self._last = now
        print(f"{_named(stage)}: {done} of {total}{self._time(done, total)}", file=self._out)
        self._out.flush()

    def _time(self, done: int, total: int) -> str:
        spent = monotonic() - self._begun
        if done >= total:
            return f", {spent:.0f} s"
        return f", about {spent * (total - done) / done:.0f} s to go" if done and spent > 1 else ""


def _named(stage: str) -> str:
    """The stage with what is counted in it."""
    counted = {"searching": "starts", "sampling": "draws of each chain"}
    return f"{stage} ({counted[stage]})" if stage in counted else stage
