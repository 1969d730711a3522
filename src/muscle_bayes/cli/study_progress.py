"""How far a study is: running stages and the time to go, as bars or, where piped, as lines."""

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from threading import Event, Thread

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from muscle_bayes.progress import INTERVAL
from muscle_bayes.study.pipeline import PROCESSES
from muscle_bayes.study.plan import PRESETS, Plan
from muscle_bayes.study.stages import Stage
from muscle_bayes.study.worker import progress_file

EVERY = 0.5
"""Time between two looks at what running stages say, s."""
SPENT = 0.95
"""Most of a stage that counts as done while it runs: its time is an estimate."""


class Display:
    """Follows the stages; safe to call from several threads."""

    def __init__(self, bars: Progress, plan: Plan, stages: Sequence[Stage]) -> None:
        self._bars, self._plan = bars, plan
        preset = PRESETS.index(plan.preset)
        self._about = {stage.name: stage.about for stage in stages}
        self._seconds = {stage.name: stage.seconds[preset] for stage in stages}
        self._waiting = dict(self._seconds)
        self._running: dict[str, tuple[TaskID, float]] = {}
        self._pace: list[float] = []
        self._whole = bars.add_task("study", total=sum(self._seconds.values()), told="")
        self._last = 0.0

    def started(self, stage: str) -> None:
        """A stage's process begins."""
        task = self._bars.add_task(
            f"  {stage}", total=self._seconds[stage], told=self._about[stage]
        )
        self._running[stage] = task, time.monotonic()

    def made(self, stage: str) -> None:
        """A stage is done."""
        task, begun = self._running.pop(stage)
        took = time.monotonic() - begun
        self._pace.append(took / self._seconds[stage])
        self._bars.remove_task(task)
        self._finish(stage, f"done in {took:.0f} s")

    def unchanged(self, stage: str) -> None:
        """A stage's result stands."""
        self._finish(stage, "unchanged")

    def _finish(self, stage: str, how: str) -> None:
        self._bars.advance(self._whole, self._waiting.pop(stage))
        self._bars.console.print(f"{stage}: {how}", markup=False, highlight=False)

    def look(self) -> None:
        """Move the bars on by what running stages say."""
        left = 0.0
        running = []
        pace = sum(self._pace) / len(self._pace) if self._pace else 1.0
        for stage, (task, begun) in list(self._running.items()):
            share = min((time.monotonic() - begun) / (pace * self._seconds[stage]), SPENT)
            self._bars.update(task, completed=share * self._seconds[stage])
            left -= share * self._seconds[stage]
            with suppress(OSError, ValueError):
                told = progress_file(self._plan.path, stage).read_text(encoding="utf-8")
                done, total, what = told.split(" ", 2)
                self._bars.update(task, told=f"{what} {done}/{total}")
                stage = f"{stage} ({what} {done}/{total})"
            running.append(stage)
        left = pace * (left + sum(self._waiting.values())) / PROCESSES
        to_go = f"about {left / 60.0:.0f} min to go" if left > 0 else ""
        self._bars.update(self._whole, told=to_go)
        if self._bars.disable and running and time.monotonic() - self._last >= INTERVAL:
            self._last = time.monotonic()
            print(f"running {', '.join(running)}; {to_go}", file=sys.stderr, flush=True)


@contextmanager
def progress(plan: Plan, stages: Sequence[Stage]) -> Iterator[Display]:
    """A display that follows a study while the block runs."""
    columns = (
        TextColumn("{task.description}", table_column=None),
        BarColumn(bar_width=24),
        TimeElapsedColumn(),
        TextColumn("{task.fields[told]}"),
    )
    console = Console(stderr=True, emoji=False)
    with Progress(*columns, console=console, disable=not console.is_terminal) as bars:
        display, ended = Display(bars, plan, stages), Event()

        def follow() -> None:
            while not ended.wait(EVERY):
                display.look()

        thread = Thread(target=follow, daemon=True)
        thread.start()
        try:
            yield display
        finally:
            ended.set()
            thread.join()
