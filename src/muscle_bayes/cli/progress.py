"""Progress of a fit on the terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def fit_progress(label: str) -> Iterator[Callable[[str, int, int], None]]:
    """A bar for each stage of a fit; yields the function that `fit` reports to."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True, emoji=False)) as bars:
        tasks: dict[str, TaskID] = {}

        def report(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(f"{label}: {stage}", total=total)
            bars.update(tasks[stage], completed=done, total=total)

        yield report
