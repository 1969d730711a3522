"""Running a study: stages in processes of their own, only those whose inputs changed."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Protocol

from doit.cmd_base import ModuleTaskLoader
from doit.dependency import JsonDB
from doit.doit_cmd import DoitMain
from doit.exceptions import BaseFail, TaskFailed
from doit.globals import Globals
from doit.reporter import ZeroReporter
from doit.task import Task
from doit.tools import config_changed

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.study.plan import PRESETS, Plan, Preset
from muscle_bayes.study.stages import Stage
from muscle_bayes.whole_file import write_whole

PROCESSES = 2
"""Stages that run side by side: each compiles and samples with more than one thread."""


class Watcher(Protocol):
    """Who wants to know how far a study is."""

    def started(self, stage: str) -> None: ...

    def made(self, stage: str) -> None: ...

    def unchanged(self, stage: str) -> None: ...


def command(stage: Stage, plan: Path) -> list[str]:
    """The process that runs one stage."""
    worker = [sys.executable, "-m", "muscle_bayes.study.worker"]
    return [*worker, stage.step, stage.name, str(plan)]


def run_stages(
    plan: Plan,
    stages: Sequence[Stage],
    watcher: Watcher,
    *,
    process_of: Callable[[Stage, Path], list[str]] = command,
) -> None:
    """Make what does not stand, as many stages at once as PROCESSES.

    What a stage made is recorded as soon as it is done, so an interrupted study goes on where it
    stopped. Raises MuscleBayesError with a stage's own message where it fails.
    """
    plan.save()
    reporter = _Reporter(watcher)
    settings = {
        "dep_file": str(plan.out / "results" / "records.json"),
        "backend": "whole",
        "reporter": reporter,
        "num_process": PROCESSES,
        "par_type": "thread",
        "verbosity": 0,
    }

    def task_stages() -> Iterator[dict[str, Any]]:
        for stage in longest_path_first(stages, plan.preset):
            yield _task(plan, stage, process_of(stage, plan.path))

    code = DoitMain(
        ModuleTaskLoader({"DOIT_CONFIG": settings, "task_stages": task_stages}),
        config_filenames=(),
        extra_config={"BACKEND": {"whole": "muscle_bayes.study.pipeline:WholeFile"}},
    ).run(["run"])
    if reporter.failed is not None:
        raise MuscleBayesError(reporter.failed)
    if code != 0:
        raise RuntimeError(f"the stages could not be run: doit ended with {code}")


class _Reporter(ZeroReporter):
    """Passes on what doit does with each stage."""

    def __init__(self, watcher: Watcher) -> None:
        super().__init__(sys.stderr, {})
        self.failed: str | None = None
        self._watcher = watcher

    def execute_task(self, task: Task) -> None:
        self._watcher.started(task.name)

    def add_success(self, task: Task) -> None:
        # doit itself writes its records at the very end: too late for a process that is killed.
        Globals.dep_manager.backend.dump()
        self._watcher.made(task.name)

    def skip_uptodate(self, task: Task) -> None:
        self._watcher.unchanged(task.name)

    def add_failure(self, task: Task, fail_info: BaseFail) -> None:
        self.failed = self.failed or f"stage {task.name}: {fail_info.message}"


def _task(plan: Plan, stage: Stage, process: list[str]) -> dict[str, Any]:
    """A stage as doit has it."""
    reads = [*plan.files(stage.runs), *stage.needs]
    return {
        "basename": stage.name,
        "actions": [(_ended_well, [process])],
        "io": {"capture": False},  # doit would redirect the output of all threads
        "file_dep": [str(path) for path in reads],
        "targets": [str(path) for path in (stage.result, *stage.also, *figures_of(stage))],
        "uptodate": [config_changed(stage.inputs(plan))],
    }


def _ended_well(process: list[str]) -> TaskFailed | None:
    """Run a stage's process to its end."""
    ended = subprocess.run(process, capture_output=True, text=True, check=False)
    return None if ended.returncode == 0 else TaskFailed(ended.stderr.strip())


def figures_of(stage: Stage) -> list[Path]:
    """Figures that a stage said it drew when it was last run: one that is gone is drawn again."""
    if stage.result.suffix != ".json" or not stage.result.exists():
        return []
    try:
        drawn = json.loads(stage.result.read_text(encoding="utf-8")).get("figures", {})
    except (json.JSONDecodeError, AttributeError):
        return []
    folder = stage.result.parents[1]
    return [
        folder / f"{figure['path']}.{kind}" for figure in drawn.values() for kind in ("svg", "png")
    ]


class WholeFile(JsonDB):
    """A JSON file that a killed process leaves as it was."""

    def dump(self) -> None:
        """Write the records, unless they stand."""
        path, content = Path(self.name), self.codec.encode(self._db).encode()
        if not (path.exists() and path.read_bytes() == content):
            write_whole(path, content)


def longest_path_first(stages: Sequence[Stage], preset: Preset) -> list[Stage]:
    """Stages by how long it takes from their beginning to the end of all that waits for them.

    With few processes this ends soonest, or nearly (critical-path list scheduling; Graham, SIAM J.
    Appl. Math. 17, 1969). Each stage comes after those it needs.
    """
    which = PRESETS.index(preset)

    @cache
    def path(place: int) -> float:
        stage = stages[place]
        made = {stage.result, *stage.also}
        after = [path(i) for i, other in enumerate(stages) if made & {*other.needs}]
        return stage.seconds[which] + max(after, default=0.0)

    return [stages[i] for i in sorted(range(len(stages)), key=lambda i: -path(i))]
