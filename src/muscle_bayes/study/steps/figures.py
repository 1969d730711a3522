"""Figures of a stage: vector and picture side by side, with a caption that says what they show."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

from muscle_bayes.data import Run
from muscle_bayes.report.style import mark_origin, save
from muscle_bayes.study.plan import Plan
from muscle_bayes.whole_file import write_whole

COLOURS = 64
"""Of a picture: enough for lines and bands, in a third of the bytes."""


def origin_of(runs: Iterable[Run]) -> str:
    """Where the data of a figure come from, as its corner says."""
    return " and ".join(sorted({run.metadata.origin for run in runs}))


@dataclass
class Drawn:
    """The figures of a stage, by key, as its result lists them."""

    plan: Plan
    listed: dict[str, dict[str, str]] = field(default_factory=dict)

    def add(self, key: str, figure: Figure, caption: str, origin: str) -> None:
        """Save as SVG and PNG. `path` in the list is relative to the study's folder, without ending."""
        mark_origin(figure, origin)
        folder = self.plan.out / "figures"
        for kind in ("svg", "png"):
            save(figure, folder / f"{key}.{kind}")
        small = BytesIO()
        Image.open(folder / f"{key}.png").convert("RGB").quantize(COLOURS).save(
            small, "png", optimize=True
        )
        write_whole(folder / f"{key}.png", small.getvalue())
        self.listed[key] = {"path": (Path("figures") / key).as_posix(), "caption": caption}
