"""Parameters before and after an effect joined the model."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.markup import unit_of
from muscle_bayes.report.style import BLACK, BLUE, GREY, VERMILLION, WIDTH, quiet_style

LOOKS = (("o", GREY, "white"), ("s", BLUE, BLUE))
"""Marker, colour and filling of the model before and of that after."""


def forest_figure(
    posteriors: Mapping[str, Posterior], published: Mapping[str, float] | None = None
) -> Figure:
    """Median, 50 and 90 % interval of each parameter in each of two models, a panel a parameter.

    Every panel has its own axis: parameters differ in unit and size. A parameter that only one model
    has is shown alone.

    Args:
        posteriors: two, by the names to show.
        published: values to mark, by parameter.

    Returns:
        A matplotlib figure.
    """
    names = list(dict.fromkeys(name for one in posteriors.values() for name in _scalars(one)))
    columns = 2 if len(names) > 3 else 1
    rows = -(-len(names) // columns)
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 0.5 + 0.62 * rows))
        axes = fig.subplots(rows, columns, squeeze=False).T.ravel()
        for axis, name in zip(axes, names, strict=False):
            for row, (look, one) in enumerate(zip(LOOKS, posteriors.values(), strict=True)):
                if name in _scalars(one):
                    _interval(axis, row, one.tree["posterior"][name].to_numpy().ravel(), look)
            _dress(axis, name, posteriors, (published or {}).get(name))
        for axis in axes[len(names) :]:
            axis.set_axis_off()
    return fig


def _scalars(posterior: Posterior) -> list[str]:
    return [name for name in posterior.parameters if posterior.tree["posterior"][name].ndim == 2]


def _interval(axis: Axes, row: int, draws: NDArray[np.float64], look: tuple[str, str, str]) -> None:
    marker, colour, filling = look
    low, quarter, middle, third, high = np.quantile(draws, [0.05, 0.25, 0.5, 0.75, 0.95])
    axis.plot([low, high], [row, row], color=colour, linewidth=1.0)
    axis.plot([quarter, third], [row, row], color=colour, linewidth=3.0)
    axis.plot(middle, row, marker, color=colour, markerfacecolor=filling, markersize=5)


def _dress(axis: Axes, name: str, posteriors: Mapping[str, Posterior], mark: float | None) -> None:
    unit = next(one.units[name] for one in reversed([*posteriors.values()]) if name in one.units)
    axis.set_yticks(range(len(posteriors)), list(posteriors), fontsize=7)
    axis.set_ylim(len(posteriors) - 0.5, -0.5)
    axis.set_title(f"{name} [{unit_of(unit or '1')}]", fontsize=8, color=BLACK)
    axis.locator_params(axis="x", nbins=5)
    axis.grid(visible=False, axis="y")
    low, high = axis.get_xlim()
    if mark is not None and low - (high - low) < mark < high + (high - low):
        axis.axvline(mark, color=VERMILLION, linestyle=(0, (4, 2)), linewidth=1.2)
