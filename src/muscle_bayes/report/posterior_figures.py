"""What a posterior says of each parameter, beside its prior, a published value or another model."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import gaussian_kde

from muscle_bayes.inference.posteriors.identifiability import Identifiability
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.markup import unit_of
from muscle_bayes.report.style import BLACK, BLUE, GREY, MARK, WIDTH, mark_origin, quiet_style

_REACH = 1.0
"""How far axes reach beyond the posterior's 98 % range, in its widths."""
_FARTHEST = 4.0
"""A published value farther than this many widths away is told by an arrow."""

Values = NDArray[np.float64]


def posterior_figure(
    posterior: Posterior, published: Mapping[str, float] | None = None, label: str = "posterior"
) -> Figure:
    """Marginal densities of all parameters in a grid, prior and posterior.

    Args:
        posterior: as `fit` gives it.
        published: values to mark, by parameter.
        label: of the posterior, in the title.

    Returns:
        A matplotlib figure; axes carry the parameters' units.
    """
    group = posterior.tree["posterior"]
    names = [name for name in posterior.parameters if group[name].ndim == 2]
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 0.7 + 1.05 * rows))
        axes = fig.subplots(rows, columns, squeeze=False).ravel()
        for axis, name in zip(axes, names, strict=False):
            draws = group[name].to_numpy().ravel(), posterior.tree["prior"][name].to_numpy().ravel()
            _marginal(axis, name, posterior.units[name], *draws, (published or {}).get(name))
        for axis in axes[len(names) :]:
            axis.remove()
        found = dict(
            pair[::-1]
            for axis in axes[: len(names)]
            for pair in zip(*axis.get_legend_handles_labels(), strict=True)
        )
        fig.legend(found.values(), found.keys(), loc="outside lower left", ncols=4)
        warning = "" if posterior.converged else " (NOT CONVERGED)"
        fig.suptitle(f"{label}{warning}", x=0.01, ha="left", fontsize=9)
        mark_origin(fig, posterior.tree.attrs.get("origin", ""))
    return fig


def _one_sign(after: Values, before: Values) -> float:
    """The sign that posterior and prior keep; 0 where they do not."""
    both = np.concatenate([after, before])
    return float(both.min() > 0.0) - float(both.max() < 0.0)


def _density(draws: Values, at: Values, sign: float) -> Values:
    """Kernel density; on logarithms where the parameter keeps a sign, for tails are long there."""
    if np.ptp(draws) == 0.0:
        return np.zeros_like(at)
    if sign == 0.0:
        middle, reach = np.median(draws), 20.0 * np.subtract(*np.quantile(draws, [0.75, 0.25]))
        near = np.abs(draws - middle) <= reach
        return near.mean() * gaussian_kde(draws[near])(at)
    valid = at * sign > 0.0
    result, size = np.zeros_like(at), np.abs(at[valid])
    result[valid] = gaussian_kde(np.log(np.abs(draws)))(np.log(size)) / size
    return result


def _limits(after: Values, before: Values, published: float | None) -> tuple[float, float]:
    """The posterior's range, widened to the prior's middle where the data say little."""
    low, high = np.quantile(after, [0.01, 0.99])
    width = max(float(high - low), 1e-12 * abs(float(high)) + 1e-300)
    low, high = float(low) - _REACH * width, float(high) + _REACH * width
    prior_low, prior_high = np.quantile(before, [0.05, 0.95])
    if prior_high - prior_low < 6.0 * width:
        low, high = min(low, float(prior_low)), max(high, float(prior_high))
    if published is not None and low - _FARTHEST * width < published < high + _FARTHEST * width:
        low, high = min(low, published - 0.3 * width), max(high, published + 0.3 * width)
    sign = _one_sign(after, before)
    return max(low, 0.0) if sign > 0.0 else low, min(high, 0.0) if sign < 0.0 else high


def _marginal(
    axis: Axes, name: str, unit: str, after: Values, before: Values, published: float | None
) -> None:
    low, high = _limits(after, before, published)
    at = np.linspace(low, high, 400)
    sign = _one_sign(after, before)
    density = _density(after, at, sign)
    prior = np.minimum(_density(before, at, sign), 1.15 * density.max())
    axis.fill_between(at, prior, color="#D5D5D5", linewidth=0, label="prior, same scale")
    axis.plot(at, prior, color=GREY, linewidth=0.8)
    axis.plot(at, density, color=BLUE, label="posterior")
    q05, q95 = np.quantile(after, [0.05, 0.95])
    within = (at >= q05) & (at <= q95)
    axis.fill_between(
        at[within], density[within], color=BLUE, alpha=0.3, linewidth=0, label="its central 90 %"
    )
    if published is not None:
        if low <= published <= high:
            axis.axvline(published, label="published value", linewidth=1.3, **MARK)
        else:
            text, place, side = f"← published {published:.4g}", 0.02, "left"
            if published > high:
                text, place, side = f"published {published:.4g} →", 0.98, "right"
            axis.text(place, 0.9, text, ha=side, fontsize=7, color=BLACK, transform=axis.transAxes)
    axis.set_xlim(low, high)
    axis.set_ylim(bottom=0.0)
    axis.set_yticks([])
    axis.locator_params(axis="x", nbins=4)
    axis.set_xlabel(f"{name} [{unit_of(unit)}]")


def identifiability_figure(found: Identifiability) -> Figure:
    """A bar a parameter: 1 - width of the posterior's 90 % interval over that of the prior's.

    Args:
        found: as `identify` gives it.

    Returns:
        A matplotlib figure.
    """
    names = list(found.parameters)[::-1]
    rows = [found.parameters[name] for name in names]
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 0.6 + 0.155 * len(names)))
        axis = fig.subplots()
        bars = axis.barh(
            names, [max(row.contraction, 0.0) for row in rows], color=BLUE, height=0.62
        )
        for place, (bar, row) in enumerate(zip(bars, rows, strict=True)):
            if row.edge:
                bar.set(hatch="////", edgecolor="white")
            text = f"{row.contraction:z.2f}" + (f", at its {row.edge} bound" if row.edge else "")
            axis.text(max(row.contraction, 0.0) + 0.01, place, text, va="center", fontsize=7)
        axis.axvline(1.0, color=GREY, linewidth=0.8)
        axis.set(xlim=(0.0, 1.25), xlabel="contraction from prior to posterior [1]")
        axis.tick_params(axis="y", labelsize=7)
        axis.grid(visible=False, axis="y")
    return fig


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
        axis.axvline(mark, linewidth=1.2, **MARK)
