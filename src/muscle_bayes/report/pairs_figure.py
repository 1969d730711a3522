"""Posterior of pairs of parameters, with prior and published values."""

from collections.abc import Mapping
from typing import Any, Final, TypeGuard

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import gaussian_kde

from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.markup import unit_of
from muscle_bayes.report.style import BLUE, GREY, MARK, WIDTH, quiet_style

Values = NDArray[np.float64]
DRAWS: Final = 800
"""Draws that densities are estimated from."""
CELLS: Final = 50
SHARES: Final = (0.9, 0.5)
"""Posterior probability inside the contours."""


def pairs_figure(posterior: Posterior, published: Mapping[str, float] | None = None) -> Figure:
    """Every pair of parameters, and on the diagonal each alone.

    Args:
        posterior: as `fit` gives it.
        published: values to mark, by parameter.

    Returns:
        A matplotlib figure.
    """
    group = posterior.tree["posterior"]
    names = [name for name in posterior.parameters if group[name].ndim == 2]
    powers = {name: _power(group[name].to_numpy()) for name in names}
    draws = {name: _thinned(group[name].to_numpy()) / 10.0 ** powers[name] for name in names}
    before = posterior.tree["prior"]
    prior = {name: before[name].to_numpy().ravel() / 10.0 ** powers[name] for name in names}
    shown = {name: value for name, value in (published or {}).items() if name in names}
    known = {name: value / 10.0 ** powers[name] for name, value in shown.items()}
    labels = {name: _label(name, posterior.units[name], powers[name]) for name in names}
    size = len(names)
    with quiet_style():
        fig = Figure(figsize=(WIDTH, WIDTH) if size > 4 else (1.8 * size, 1.8 * size))
        axes = fig.subplots(size, size, squeeze=False, sharex="col")
        for row, y in enumerate(names):
            for column, x in enumerate(names):
                axis = axes[row, column]
                if column > row:
                    axis.set_axis_off()
                elif column == row:
                    _alone(axis, draws[x], prior[x], known.get(x))
                else:
                    marks = (known.get(x), known.get(y))
                    _pair(axis, (draws[x], draws[y]), (prior[x], prior[y]), marks)
                _frame(axis, (labels[x], labels[y]), (row, column), size)
        fig.align_ylabels(axes[:, 0])
    return fig


def _thinned(values: Values) -> Values:
    flat = values.ravel()
    return flat[np.linspace(0, flat.size - 1, min(DRAWS, flat.size)).astype(int)]


def _limits(values: Values) -> tuple[float, float]:
    low, high = np.quantile(values, [0.005, 0.995])
    reach = 0.25 * max(high - low, 1e-12 * abs(high) + 1e-300)
    return float(low - reach), float(high + reach)


def _within(value: float | None, limits: tuple[float, float]) -> TypeGuard[float]:
    return value is not None and limits[0] <= value <= limits[1]


def _alone(axis: Axes, values: Values, prior: Values, mark: float | None) -> None:
    limits = _limits(values)
    at = np.linspace(*limits, 200)
    density = gaussian_kde(values)(at)
    near = prior[(prior >= limits[0]) & (prior <= limits[1])]
    if near.size > 20 and np.ptp(near) > 0.0:
        told = near.size / prior.size * gaussian_kde(near)(at)
        axis.fill_between(at, np.minimum(told, 1.1 * density.max()), color="#D5D5D5", linewidth=0)
    axis.plot(at, density, color=BLUE, linewidth=1.0)
    if _within(mark, limits):
        axis.axvline(mark, linewidth=1.0, **MARK)
    axis.set_xlim(*limits)
    axis.set_ylim(bottom=0.0)
    axis.set_yticks([])


def _pair(
    axis: Axes,
    pair: tuple[Values, Values],
    prior: tuple[Values, Values],
    marks: tuple[float | None, float | None],
) -> None:
    limits = _limits(pair[0]), _limits(pair[1])
    for side, (values, (low, high)) in enumerate(zip(prior, limits, strict=True)):
        ends = np.quantile(values, [0.05, 0.95])
        draw = axis.axvspan if side == 0 else axis.axhspan
        if ends[0] > low or ends[1] < high:
            draw(max(ends[0], low), min(ends[1], high), color="#E9E9E9", linewidth=0, zorder=0)
    at = [np.linspace(*one, CELLS) for one in limits]
    density, levels = _density(pair, at)
    axis.contourf(*at, density, levels=[*levels, np.inf], colors=["#C7DFEE", "#5B9EC9"])
    axis.contour(*at, density, levels=levels, colors=[BLUE], linewidths=0.7)
    if _within(marks[0], limits[0]):
        axis.axvline(marks[0], linewidth=0.8, **MARK)
    if _within(marks[1], limits[1]):
        axis.axhline(marks[1], linewidth=0.8, **MARK)
    axis.set_xlim(*limits[0])
    axis.set_ylim(*limits[1])


def _density(pair: tuple[Values, Values], at: list[Values]) -> tuple[Values, list[float]]:
    """Density on the grid, scaled, and its values on the borders of SHARES' regions."""
    scale = [float(np.std(one)) for one in pair]
    draws = np.stack([one / s for one, s in zip(pair, scale, strict=True)])
    # Draws that fill a line have no density in the plane.
    draws = draws + 1e-3 * np.random.default_rng(0).standard_normal(draws.shape)
    kernel = gaussian_kde(draws)
    grid = np.meshgrid(*(one / s for one, s in zip(at, scale, strict=True)))
    density = kernel(np.stack([one.ravel() for one in grid])).reshape(grid[0].shape)
    inside = kernel(draws)
    return density, [float(np.quantile(inside, 1.0 - share)) for share in SHARES]


def _frame(axis: Axes, labels: tuple[str, str], place: tuple[int, int], size: int) -> None:
    """Labels at the left and the lower edge only."""
    row, column = place
    axis.tick_params(labelsize=7)
    axis.locator_params(nbins=2 if size > 4 else 3)
    axis.grid(visible=False)
    if row == size - 1:
        many = size > 4  # labels lie side by side, or would cover each other
        style: Any = {"rotation": 60, "ha": "right", "va": "top"} if many else {}
        axis.set_xlabel(labels[0].replace("\n", " ") if many else labels[0], fontsize=7, **style)
        axis.tick_params(axis="x", labelrotation=60)
    else:
        axis.tick_params(labelbottom=False)
    if column == 0 and row > 0:
        upright: Any = {"rotation": 0, "ha": "right", "va": "center"} if size > 4 else {}
        axis.set_ylabel(labels[1], fontsize=7, **upright)
    else:
        axis.tick_params(labelleft=False)
    axis.spines["right"].set(visible=column < row, color=GREY, linewidth=0.4)


def _power(values: Values) -> int:
    """Power of ten that an axis leaves to its label, so that its numbers stay short."""
    exponent = int(np.floor(np.log10(max(float(np.abs(values).max()), 1e-300))))
    return exponent if not -3 < exponent < 5 else 0


def _label(name: str, unit: str, power: int) -> str:
    factor = f"$10^{{{power}}}$ " if power else ""
    return f"{name}\n[{factor}{unit_of(unit or '1')}]"
