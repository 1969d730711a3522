"""One quiet look for every figure: colours that all eyes tell apart, and in grey as well."""

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from muscle_bayes.whole_file import write_whole

# Okabe and Ito's palette; vermillion and sky blue differ from blue in lightness too.
BLACK: Final = "#000000"
ORANGE: Final = "#E69F00"
SKY: Final = "#56B4E9"
GREEN: Final = "#009E73"
BLUE: Final = "#0072B2"
VERMILLION: Final = "#D55E00"
PURPLE: Final = "#CC79A7"
GREY: Final = "#8A8A8A"
PALETTE: Final = (BLUE, ORANGE, GREEN, VERMILLION, SKY, PURPLE, BLACK)
MARK: Final[Any] = {"color": VERMILLION, "linestyle": (0, (4, 2))}
"""Line at a published value."""

DPI: Final = 150
WIDTH: Final = 6.5
"""Of a printed line, inch: figures as wide as this or narrower are printed as they are drawn."""
SMALLEST: Final = 7.0
"""Smallest text of a figure, points."""
# Without these entries files would name the matplotlib version and the day that wrote them.
_ANONYMOUS: Final[Any] = {"png": {"Software": None}, "svg": {"Creator": None, "Date": None}}

_STYLE: Final = Path(__file__).with_name("quiet.mplstyle")


@contextmanager
def quiet_style() -> Iterator[None]:
    """The look, for figures made inside the `with` block."""
    with matplotlib.rc_context(fname=_STYLE):
        yield


def save(fig: Figure, path: Path) -> None:
    """Write a PNG at 150 dpi, or an SVG, the same bytes for the same figure.

    Raises MuscleBayesError where it cannot be written.
    """
    kind = path.suffix.removeprefix(".")
    content = BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": path.stem}):
        fig.savefig(content, format=kind, dpi=DPI, metadata=_ANONYMOUS[kind])
    write_whole(path, content.getvalue())


Values = NDArray[np.float64]

INTERVALS = ((0.9, "#C7DFEE"), (0.5, "#7DB6D9"))
"""Central share and colour, widest first; the narrower is the darker."""


def draw_bands(axis: Axes, time: Values, draws: Values, told: str) -> None:
    """The 90 and 50 % intervals of draws (draw, time) as nested bands."""
    for level, shade in INTERVALS:
        tail = 0.5 * (1.0 - level)
        low, high = np.quantile(draws, [tail, 1.0 - tail], axis=0)
        label = f"{level:.0%} of {told}"
        axis.fill_between(time, low, high, color=shade, linewidth=0, label=label)


def mark_origin(fig: Figure, origin: str) -> None:
    """Say in the lower right corner that data are synthetic, where they are; once."""
    said = "Synthetic data"
    if "synthetic" not in origin.lower() or said in [text.get_text() for text in fig.texts]:
        return
    told: dict[str, Any] = {"x": 0.998, "ha": "right", "fontsize": SMALLEST, "color": GREY}
    if fig.get_supxlabel():  # its line is there already
        fig.text(y=0.005, s=said, va="bottom", **told)
    else:
        fig.supxlabel(said, **told)
