"""Central intervals of draws, drawn so that they read in grey as well."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from muscle_bayes.report.style import GREY

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
    """Say in the lower right corner that data are synthetic, where they are."""
    if "synthetic" in origin.lower():
        fig.supxlabel("Synthetic data", x=0.998, ha="right", fontsize=7, color=GREY)
