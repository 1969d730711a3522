"""Figures of a stage: vector and picture side by side, with a caption that tells their origin."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from matplotlib.figure import Figure

from muscle_bayes.data import Run
from muscle_bayes.report.style import save
from muscle_bayes.study.plan import Plan


def origin_of(runs: Iterable[Run]) -> str:
    """How captions begin: synthetic data are called so wherever they are shown."""
    origins = {run.metadata.origin for run in runs}
    if origins == {"synthetic"}:
        return "Synthetic data."
    return "Measured data." if origins == {"measured"} else "Measured and synthetic data."


@dataclass
class Drawn:
    """The figures of a stage, by key, as its result lists them."""

    plan: Plan
    listed: dict[str, dict[str, str]] = field(default_factory=dict)

    def add(self, key: str, figure: Figure, caption: str, origin: str) -> None:
        """Save as SVG and PNG. `path` in the list is relative to the study's folder, without ending."""
        for kind in ("svg", "png"):
            save(figure, self.plan.out / "figures" / f"{key}.{kind}")
        path = (Path("figures") / key).as_posix()
        self.listed[key] = {"path": path, "caption": f"{origin} {caption}"}
