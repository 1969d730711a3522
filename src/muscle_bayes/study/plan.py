"""What a study is about, as every stage gets it: runs, roles, settings and folders."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import TypeAdapter

from muscle_bayes.data import Run, find_runs, read_run, read_runs
from muscle_bayes.json_file import write_json
from muscle_bayes.study.config import Published, StudyConfig
from muscle_bayes.study.published import published_by
from muscle_bayes.study.roles import Roles, roles_of

Preset = Literal["quick", "full"]
PRESETS: tuple[Preset, ...] = ("quick", "full")


@dataclass(frozen=True)
class Plan:
    """A study with nothing left open. Written to PLAN.json for the processes that run its stages."""

    out: Path
    logs: dict[str, Path]
    """Each run's CSV."""
    roles: Roles
    preset: Preset
    config: StudyConfig
    joint: Path | None = None
    device: str = "cpu"
    started_as: str = ""
    """The command that repeats the study."""
    calibrations: tuple[Path, ...] = field(default=())
    """Results of slow checks of the method that are there."""

    @classmethod
    def of(
        cls, folder: Path, out: Path, preset: Preset, config: StudyConfig, where: str, **more: Any
    ) -> "Plan":
        """The plan for a folder of runs. Raises MuscleBayesError for runs and roles that cannot be."""
        logs = find_runs([folder])
        runs = read_runs([folder])
        roles = roles_of(runs, config, where)
        return cls(out, {log.stem: log for log in logs}, roles, preset, config, **more)

    def run(self, name: str) -> Run:
        """A run as logged."""
        return read_run(self.logs[name])

    def runs(self, names: Sequence[str]) -> list[Run]:
        """Runs as logged."""
        return [self.run(name) for name in names]

    def fitted(self, names: Sequence[str]) -> list[Run]:
        """Runs as they are fitted: some only to a time."""
        return [
            run if (end := self.roles.until.get(run.name)) is None else run.until(end)
            for run in self.runs(names)
        ]

    def files(self, names: Sequence[str]) -> list[Path]:
        """Files of these runs."""
        found = [self.logs[name] for name in names]
        return [file for log in found for file in (log, log.with_suffix(".toml"))]

    @property
    def published(self) -> tuple[Published, ...]:
        """Tables to stand beside our posteriors."""
        return published_by(self.config)

    def result(self, stage: str) -> Path:
        """Where a stage leaves its numbers."""
        return self.out / "results" / f"{stage}.json"

    def found(self, stage: str) -> dict[str, Any]:
        """The numbers of a stage that has been run."""
        return json.loads(self.result(stage).read_text(encoding="utf-8"))

    def summary(self) -> dict[str, Any]:
        """The study's numbers, once its report is written."""
        return json.loads((self.out / "summary.json").read_text(encoding="utf-8"))

    def posterior(self, fit: str) -> Path:
        """Where a fit leaves its posterior."""
        return self.out / "posteriors" / f"{fit}.nc"

    @property
    def path(self) -> Path:
        """Where the plan itself lies."""
        return self.out / "results" / "plan.json"

    def save(self) -> None:
        """Write PLAN.json, unless it stands as it is."""
        write_json(self.path, TypeAdapter(Plan).dump_python(self, mode="json"))

    @classmethod
    def load(cls, path: Path) -> "Plan":
        """Read PLAN.json."""
        return TypeAdapter(cls).validate_json(path.read_bytes())


FILES: Final = ("calibration.json", "trial.json", "gradient.json", "sampling.json")
"""What `muscle-bayes sbc`, `make trial` and the benchmarks of gradient and sampler write."""


def available(folders: Iterable[Path], own: Path) -> tuple[Path, ...]:
    """Such results in these folders and one below, but for the study's `own`."""
    found = [
        path
        for folder in folders
        for name in FILES
        for path in (*folder.glob(name), *folder.glob(f"*/{name}"))
        if path.parent != own
    ]
    return tuple(sorted(set(found)))
