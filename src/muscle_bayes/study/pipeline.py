"""The stages of the study and what each needs."""

import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from muscle_bayes.conventions import Friction
from muscle_bayes.data import Run, read_runs
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.assemble import LIBRARIES
from muscle_bayes.inference.fit import EFFORTS, FIT_LAYERS, fit
from muscle_bayes.inference.posterior import Posterior
from muscle_bayes.inference.summary import summarise
from muscle_bayes.provenance import fingerprint, source_checksum
from muscle_bayes.study.stage import Stage

Progress = Callable[[str], AbstractContextManager[Callable[[str, int, int], None]]]


@dataclass(frozen=True)
class Study:
    """Where the study reads and writes, and how long it samples."""

    runs: tuple[Run, ...]
    out: Path
    preset: str
    seed: int
    progress: Progress

    @classmethod
    def of(cls, folder: Path, out: Path, preset: str, seed: int, progress: Progress) -> "Study":
        """The study of a folder with spring, staircase and sawtooth runs.

        Raises MuscleBayesError if the folder lacks spring or staircase runs.
        """
        study = cls(tuple(read_runs([folder])), out, preset, seed, progress)
        for protocol in ("spring", "staircase"):
            if not study.of_protocol(protocol):
                raise MuscleBayesError(
                    f"{folder}: has no {protocol} run, the study needs at least one. "
                    "Mend: add runs, or fit what there is with `muscle-bayes fit`."
                )
        return study

    def of_protocol(self, *protocols: str) -> tuple[Run, ...]:
        """The runs of these protocols."""
        return tuple(run for run in self.runs if run.metadata.protocol in protocols)

    def posterior_path(self, name: str) -> Path:
        """Where a fit's posterior lies."""
        return self.out / "posteriors" / f"{name}.nc"

    def posterior(self, name: str) -> Posterior:
        """A fit's posterior, once its stage is done."""
        return Posterior.load(self.posterior_path(name))

    def inputs(self, runs: tuple[Run, ...], layers: tuple[str, ...], **more: Any) -> dict[str, Any]:
        """What a stage depends on."""
        return {
            "runs": {run.name: run.checksum for run in runs},
            "preset": self.preset,
            "seed": self.seed,
            "source": source_checksum(*layers),
            "versions": {name: version(name) for name in LIBRARIES},
            **more,
        }


def _fit_stage(
    study: Study, name: str, runs: tuple[Run, ...], friction: Friction, given: Stage | None
) -> Stage:
    earlier = None if given is None else fingerprint(given.inputs)
    inputs = study.inputs(runs, FIT_LAYERS, friction=friction, given=earlier)

    def make() -> None:
        with study.progress(name) as report:
            posterior = fit(
                runs,
                friction,
                effort=EFFORTS[study.preset],
                given=None if given is None else study.posterior(given.name),
                seed=study.seed,
                report=report,
            )
        posterior.save(study.posterior_path(name))

    return Stage(name, study.posterior_path(name), inputs, make)


def stages(study: Study) -> Iterator[Stage]:
    """All stages, in an order in which each finds what it needs."""
    springs = study.of_protocol("spring")
    staircases = study.of_protocol("staircase")
    fixture = _fit_stage(study, "fixture-coulomb", springs, "coulomb", None)
    yield fixture
    yield _fit_stage(study, "fixture-linear", springs, "linear", None)
    yield _fit_stage(study, "muscle", staircases, "coulomb", fixture)
    from muscle_bayes.study.report import write_report

    yield Stage(
        "report",
        study.out / "summary.md",
        study.inputs(study.runs, (*FIT_LAYERS, "criticism", "report", "study")),
        lambda: write_report(study),
    )


def unconverged(study: Study) -> dict[str, list[str]]:
    """Complaints of each fit that has not converged."""
    result = {}
    for name in ("fixture-coulomb", "fixture-linear", "muscle"):
        summary = summarise(study.posterior(name))
        if not summary["converged"]:
            result[name] = summary["complaints"]
    return result


def results(study: Study) -> dict[str, Any]:
    """The numbers of the report."""
    return json.loads((study.out / "summary.json").read_text())
