"""Predictions of a run beside what was logged, and creep while cold."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from muscle_bayes.criticism.coverage import RunCheck, judged_unit
from muscle_bayes.criticism.drift import ColdPhase, Drift
from muscle_bayes.inference.posteriors.predict import Prediction
from muscle_bayes.report.style import (
    BLACK,
    BLUE,
    GREY,
    VERMILLION,
    WIDTH,
    draw_bands,
    mark_origin,
    quiet_style,
)

_LEGEND: Final[Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.2}
_DOT: Final[Any] = {"marker": ".", "markersize": 2.5, "linestyle": "none", "color": BLACK}


def predictive_figure(prediction: Prediction, check: RunCheck, origin: str) -> Figure:
    """Readings with predictive intervals, temperature where it varies, and residuals.

    Args:
        prediction: of one run, as `predict` gives it.
        check: the same prediction's, as `check` gives it.
        origin: "measured" or "synthetic", as the run's metadata have it.

    Returns:
        A matplotlib figure: readings and residuals [the log's unit], temperature [C], over time [s].
    """
    heated = np.ptp(prediction.temperature) > 2.0
    heights = [2.4, 1.0, 1.4] if heated else [2.4, 1.4]
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 0.7 + 0.85 * sum(heights)))
        axes = fig.subplots(len(heights), sharex=True, height_ratios=heights)
        _readings(axes[0], prediction)
        if heated:
            axes[1].plot(prediction.time, prediction.temperature, color=VERMILLION)
            axes[1].set_ylabel("$T_A$ [°C]")
        draw_residuals(axes[-1], prediction)
        for axis in axes:
            axis.margins(x=0.01)
        axes[-1].set_xlabel("time [s]")
        fig.suptitle(_title(prediction, check), x=0.01, ha="left", fontsize=9)
        mark_origin(fig, origin)
        fig.align_ylabels(list(axes))
    return fig


def _title(prediction: Prediction, check: RunCheck) -> str:
    rmse = f"RMSE {check.rmse:.3g} {check.unit}"
    if check.unit != check.judged_unit:
        rmse += f" = {check.judged_rmse:.3g} {check.judged_unit}"
    shares = (
        f"{check.coverage50:.0%} of readings in the 50 % band, {check.coverage90:.0%} in the 90 %"
    )
    return f"{prediction.run}: {rmse}\n{shares}"


def _readings(axis: Axes, prediction: Prediction) -> None:
    draw_readings(axis, prediction)
    axis.legend(ncols=4, **_LEGEND)
    unit, factor = judged_unit(prediction)
    first = float(prediction.observed[0])
    second = axis.secondary_yaxis(
        "right",
        functions=(
            lambda reading: factor * (np.asarray(reading) - first),
            lambda moved: np.asarray(moved) / factor + first,
        ),
    )
    second.set_ylabel(f"moved [{unit}]")


def draw_readings(axis: Axes, prediction: Prediction) -> None:
    """Predictions as bands, the mean model, and what was logged."""
    draw_bands(axis, prediction.time, prediction.reading, "predictions")
    mean = prediction.model.mean(axis=0)
    axis.plot(prediction.time, mean, color=BLUE, linewidth=1.1, label="mean model")
    axis.plot(prediction.time, prediction.observed, label="logged (interval means)", **_DOT)
    axis.set_ylabel(f"reading [{prediction.unit}]")


def draw_residuals(axis: Axes, prediction: Prediction) -> None:
    """Readings minus the mean model, with the predictions' bands about it."""
    mean = prediction.model.mean(axis=0)
    draw_bands(axis, prediction.time, prediction.reading - mean, "predictions")
    axis.axhline(0.0, color=BLUE, linewidth=1.0)
    axis.plot(prediction.time, prediction.observed - mean, **_DOT)
    axis.set_ylabel(f"residual\n[{prediction.unit}]")


def prior_predictive_figure(
    predictions: Sequence[Prediction], origin: str = "measured", limit: float = 5.0
) -> Figure:
    """Readings that the prior allows, one panel for each run.

    The prior may reach far beyond the sensor; axes end `limit` times the logged range away.

    Args:
        predictions: as `prior_predict` gives them.
        origin: "measured" or "synthetic", as the runs' metadata have it.
        limit: see above.

    Returns:
        A matplotlib figure: readings [the log's unit] over time [s].
    """
    rows = -(-len(predictions) // 2)
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 0.6 + 1.6 * rows))
        axes = fig.subplots(rows, min(2, len(predictions)), squeeze=False).ravel()
        for axis, prediction in zip(axes, predictions, strict=False):
            draw_bands(axis, prediction.time, prediction.model, "prior models")
            axis.plot(prediction.time, prediction.observed, label="logged", **_DOT)
            middle, span = (
                np.mean(prediction.observed),
                max(float(np.ptp(prediction.observed)), 1e-9),
            )
            low, high = np.quantile(prediction.model, [0.05, 0.95])
            low, high = max(low, middle - limit * span), min(high, middle + limit * span)
            seen = prediction.observed.min(), prediction.observed.max()
            axis.set_ylim(min(low, seen[0]) - 0.1 * span, max(high, seen[1]) + 0.1 * span)
            axis.margins(x=0.01)
            axis.set_title(prediction.run)
            axis.set(xlabel="time [s]", ylabel=f"reading [{prediction.unit}]")
        for axis in axes[len(predictions) :]:
            axis.remove()
        handles, labels = axes[0].get_legend_handles_labels()
        fig.legend(handles, labels, loc="outside upper right", ncols=3)
        fig.suptitle("Prior predictions", x=0.01, ha="left", fontsize=9)
        mark_origin(fig, origin)
    return fig


def drift_figure(prediction: Prediction, drift: Drift, origin: str = "measured") -> Figure:
    """Each cold phase from its start, and measured against predicted slopes of all of them.

    Args:
        prediction: of one run, as `predict` gives it.
        drift: of the same prediction, by `muscle_bayes.criticism.drift.drift`.
        origin: "measured" or "synthetic", as the run's metadata have it.

    Returns:
        A matplotlib figure: creep [deg or mm] over time [s].
    """
    count = max(len(drift.phases), 1)
    columns = min(count, 4)
    rows = -(-count // columns)
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 0.7 + 1.2 * rows + 1.4))
        fig.suptitle(_drift_title(drift), x=0.01, ha="left", fontsize=9)
        mark_origin(fig, origin)
        if not drift.phases:
            fig.text(0.5, 0.5, f"no cold phase: {drift.reason}", ha="center", wrap=True)
            return fig
        grid = fig.add_gridspec(rows + 1, columns, height_ratios=[1.0] * rows + [1.3])
        shared: Axes | None = None
        for number, phase in enumerate(drift.phases):
            axis = fig.add_subplot(grid[number // columns, number % columns], sharey=shared)
            shared = shared or axis
            _phase(axis, prediction, phase, number)
            if number % columns == 0:
                axis.set_ylabel(f"moved [{drift.unit}]")
            else:
                axis.tick_params(labelleft=False)
        _slopes(fig.add_subplot(grid[rows, :]), drift)
        handles, labels = shared.get_legend_handles_labels() if shared else ([], [])
        fig.legend(handles, labels, loc="outside lower left", ncols=4)
    return fig


def _drift_title(drift: Drift) -> str:
    head = f"{drift.run}: creep while cold after heating"
    if (d := drift.slope_difference) is None:
        return head
    return (
        f"{head}\nmeasured minus predicted, mean of phases: {d.mean:+.3g} {drift.unit}/min, "
        f"90 % interval {d.q05:+.3g} to {d.q95:+.3g}"
    )


def _phase(axis: Axes, prediction: Prediction, phase: ColdPhase, number: int) -> None:
    own = (prediction.time >= phase.start) & (prediction.time <= phase.end)
    time = (prediction.time[own] - phase.start) / 60.0
    factor = judged_unit(prediction)[1]
    model = factor * prediction.model[:, own]
    observed = factor * prediction.observed[own]
    # Levels differ by far more than creep does: each is shown from its own mean start.
    ends = max(2, time.size // 10)
    model = model - model[:, :ends].mean(axis=1, keepdims=True)
    draw_bands(axis, time, model, "models, no noise")
    axis.plot(time, model.mean(axis=0), color=BLUE, linewidth=1.1, label="mean model")
    axis.plot(time, observed - observed[:ends].mean(), label="logged", **_DOT)
    axis.set_title(f"{number + 1}: from {phase.start:.0f} s, {phase.load * 1e3:.0f} g", fontsize=8)
    axis.set_xlabel("time [min]")


def _slopes(axis: Axes, drift: Drift) -> None:
    place = np.arange(1, len(drift.phases) + 1)
    creeps = [phase.slope for phase in drift.phases]
    measured = np.array([creep.measured for creep in creeps])
    error = 1.645 * np.array([creep.standard_error for creep in creeps])
    middle = np.array([creep.predicted.mean for creep in creeps])
    ends = np.array([[c.predicted.q05, c.predicted.q95] for c in creeps]).T
    style: Any = {"linestyle": "none", "capsize": 3, "markersize": 5}
    reach = np.maximum(np.abs(ends - middle), 0.0)
    axis.errorbar(
        place - 0.1, measured, error, marker="o", color=BLACK, label="measured, 90 %", **style
    )
    hollow: Any = {"marker": "s", "color": BLUE, "mfc": "white", "label": "model, 90 %"}
    axis.errorbar(place + 0.1, middle, reach, **hollow, **style)
    axis.axhline(0.0, color=GREY, linewidth=0.8)
    axis.set_xticks(place)
    axis.set_xlim(0.5, place[-1] + 0.5)
    axis.set(xlabel="cold phase", ylabel=f"slope [{drift.unit}/min]")
    axis.legend(ncols=2, **_LEGEND)
