"""Figures of a discovery: misfit map before and after, probabilities, overlays."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from muscle_bayes.discovery.conditions import Trace
from muscle_bayes.discovery.locate import MisfitMap
from muscle_bayes.discovery.result import Curve, Discovery, Judged, Step
from muscle_bayes.report.predictive_figures import draw_readings, draw_residuals
from muscle_bayes.report.style import (
    BLACK,
    BLUE,
    GREY,
    VERMILLION,
    WIDTH,
    mark_origin,
    quiet_style,
    save,
)
from muscle_bayes.report.words import SIGNALS

LEAST_SHOWN = 0.001
"""Least probability that gets a bar."""


def write_figures(found: Discovery, folder: Path, origins: Mapping[str, str]) -> None:
    """Write misfit-map.png, probabilities.png and RUN.png for every run; unknown.png of a function
    that nobody has named. Raises OSError.
    """
    save(misfit_figure(found, origins), folder / "misfit-map.png")
    save(probability_figure(found), folder / "probabilities.png")
    for step in found.steps:
        if step.curve is not None:
            save(unknown_figure(step, step.curve, origins), folder / "unknown.png")
    for run in found.nominal.predictions:
        save(before_after_figure(found, run, origins[run]), folder / f"{run}.png")


def misfit_figure(found: Discovery, origins: Mapping[str, str]) -> Figure:
    """Residuals of every fitted run, what was located shaded; before, and after where effects came.

    Args:
        found: as `discover` gives it.
        origins: "measured" or "synthetic", of each run by name.

    Returns:
        A matplotlib figure: residuals [the log's unit] over time [s].
    """
    maps = [("before", found.located)]
    if found.steps:
        maps.append(("after", found.final.misfit))
    lines = found.located.traces
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 0.7 + 0.5 * len(lines)))
        axes = fig.subplots(len(lines), len(maps), squeeze=False, sharey="row")
        for column, (when, one) in enumerate(maps):
            for row, line in enumerate(one.traces):
                _residuals(axes[row, column], line, one)
                if column == 0:
                    axes[row, 0].set_ylabel(
                        f"{line.run}\n[{line.unit}]",
                        fontsize=7,
                        rotation=0,
                        ha="right",
                        va="center",
                    )
            axes[0, column].set_title(f"{when}: p = {one.p_value:.2g}")
            axes[-1, column].set_xlabel("time [s]")
        fig.suptitle(
            "Where readings disagree with the model: reading minus model;\n"
            "shaded where the misfit exceeds what noise and uncertain parameters allow",
            x=0.01,
            ha="left",
            fontsize=9,
        )
        mark_origin(fig, " ".join(origins.values()))
    return fig


def discovery_figure(found: Discovery, run: str, origin: str) -> Figure:
    """The discovery in one line: a run's residuals before, what may be missing, residuals after.

    Args:
        found: as `discover` gives it.
        run: name of a run that was fitted.
        origin: "measured" or "synthetic", as the run's metadata have it.

    Returns:
        A matplotlib figure: residuals [the log's unit] over time [s], probabilities between them.
    """
    maps = [("before", found.located), ("after", found.final.misfit)][: 1 + bool(found.steps)]
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 2.1))
        axes: Any = fig.subplots(1, 1 + len(maps), width_ratios=[1.0, 0.75, 1.0][: 1 + len(maps)])
        for axis, (when, one) in zip((axes[0], axes[-1]), maps, strict=False):
            for line in one.traces:
                if line.run == run:
                    _residuals(axis, line, one)
                    axis.set(xlabel="time [s]", ylabel=f"residual [{line.unit}]")
            axis.set_title(f"{run}, {when}", fontsize=8)
        if found.steps:
            axes[-1].sharey(axes[0])
        _bars(axes[1], found, most=5)
        then = [step.added for step in found.steps[1:]]
        axes[1].set_title("what is missing?" + " First:" * bool(then), fontsize=8)
        if then:
            axes[1].set_xlabel(f"probability; then {', '.join(then)}")
        mark_origin(fig, origin)
    return fig


def _residuals(axis: Axes, line: Trace, found: MisfitMap) -> None:
    axis.axhline(0.0, color=BLUE, linewidth=0.8)
    axis.plot(line.time, line.residual, ".", color=BLACK, markersize=1.5)
    for one in found.windows:
        if one.run == line.run:
            axis.axvspan(one.start, one.end, color=VERMILLION, alpha=0.25, linewidth=0)
    axis.margins(x=0.01)


def unknown_figure(step: Step, curve: Curve, origins: Mapping[str, str]) -> Figure:
    """What a function that nobody has named adds to its port, over what it depends on."""
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 2.8))
        axis = fig.subplots()
        axis.axhline(0.0, color=GREY, linewidth=0.8)
        axis.fill_between(
            curve.signal, curve.low, curve.high, color=BLUE, alpha=0.25, linewidth=0, label="90 %"
        )
        axis.plot(curve.signal, curve.median, color=BLUE, label="median")
        ((signal, own),) = (SIGNALS[name] for name in step.signals)
        what = "logarithm of the damper" if step.port == "damper" else step.port
        unit = "" if curve.unit == "1" else f" [{curve.unit}]"
        axis.set(xlabel=f"{signal} [{own}]", ylabel=f"change of the {what}{unit}")
        axis.margins(x=0.01)
        axis.legend(fontsize=7)
        axis.set_title(f"Unknown effect on the {step.port}")
        mark_origin(fig, " ".join(origins.values()))
    return fig


def probability_figure(found: Discovery) -> Figure:
    """Probability of every effect, of none and of unknown, in the first step.

    Args:
        found: as `discover` gives it.

    Returns:
        A matplotlib figure.
    """
    with quiet_style():
        count = sum(value >= LEAST_SHOWN for value in found.probabilities.values())
        fig = Figure(figsize=(WIDTH, 0.8 + 0.22 * count))
        _bars(fig.subplots(), found, most=count)
    return fig


def _bars(axis: Axes, found: Discovery, most: int) -> None:
    """The likeliest answers to what the model lacks."""
    ordered = sorted(found.probabilities.items(), key=lambda item: -item[1])
    shown = [item for item in ordered if item[1] >= LEAST_SHOWN][:most][::-1]
    axis.barh([name for name, _ in shown], [value for _, value in shown], color=BLUE, height=0.6)
    for row, (_, value) in enumerate(shown):
        axis.text(value + 0.02, row, f"{value:.0%}", va="center", fontsize=7)
    axis.set(xlim=(0.0, 1.2), xlabel="probability")
    axis.tick_params(axis="y", labelsize=7)
    axis.grid(visible=False, axis="y")


def before_after_figure(found: Discovery, run: str, origin: str) -> Figure:
    """Readings with predictive bands, and residuals beneath: nominal model, revised model.

    Args:
        found: as `discover` gives it.
        run: name of one of its runs.
        origin: "measured" or "synthetic", as the run's metadata have it.

    Returns:
        A matplotlib figure: readings and residuals [the log's unit] over time [s].
    """
    models: list[tuple[str, Judged]] = [("nominal", found.nominal)]
    if found.steps:
        models.append(("with " + " + ".join(step.added for step in found.steps), found.final))
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 3.2))
        axes = fig.subplots(2, len(models), squeeze=False, sharex=True, sharey="row")
        for column, (name, judged) in enumerate(models):
            _overlay(axes[:, column], judged, run, name)
        handles, labels = axes[0, 0].get_legend_handles_labels()
        fig.legend(handles, labels, fontsize=7, ncols=4, loc="outside lower left")
        held = ", held out" if run in found.held_out else ""
        fig.suptitle(f"{run}{held}", x=0.01, ha="left", fontsize=9)
        mark_origin(fig, origin)
    return fig


def _overlay(axes, judged: Judged, run: str, name: str) -> None:
    prediction, check = judged.predictions[run], judged.checks[run]
    draw_readings(axes[0], prediction)
    axes[0].set_title(f"{name}\nRMSE {check.rmse:.3g} {check.unit}", fontsize=9)
    draw_residuals(axes[1], prediction)
    axes[1].set_xlabel("time [s]")
    if prediction.ahead_from > 0.0:
        for axis in axes:
            axis.axvline(prediction.ahead_from, color=GREY, linestyle=":", linewidth=1.0)
    for axis in axes:
        axis.margins(x=0.01)
