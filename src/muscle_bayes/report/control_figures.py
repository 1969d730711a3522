"""Responses of a controlled joint in every scenario, with bands over the draws (thesis, Fig. 31-39)."""

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from muscle_bayes.control.batch import SHOWN_EVERY
from muscle_bayes.control.metrics import SAFE_TEMPERATURE
from muscle_bayes.control.scenario import Scenario
from muscle_bayes.control.study import Robustness, RunawayCurve
from muscle_bayes.report.bands import draw_bands
from muscle_bayes.report.style import BLACK, BLUE, GREY, ORANGE, SKY, VERMILLION, WIDTH, quiet_style

_LEGEND: Final[Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 0.98), "borderaxespad": 0.0}


def scenario_figure(result: Robustness, scenario: Scenario) -> Figure:
    """Angle, temperatures and, where there is one, load of one scenario.

    Args:
        result: of gains that were judged, by `muscle_bayes.control.study.robustness`.
        scenario: one of those on which they were judged.

    Returns:
        A matplotlib figure: angle [rad], temperatures [C] and load [kg] over time [s].
    """
    outcome, time = result.outcomes[scenario.name], result.time(scenario.name)
    course = scenario.course
    loaded = bool(np.any(course.load))
    heights = [2.0, 1.4] + [0.7] * loaded
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 1.0 + 1.1 * sum(heights)))
        fig.suptitle(_title(result, scenario), x=0.01, ha="left", fontsize=9)
        axes = fig.subplots(len(heights), sharex=True, squeeze=False, height_ratios=heights)[:, 0]
        _angle(axes[0], time, outcome.angle, np.asarray(course.setpoint[::SHOWN_EVERY]))
        _temperatures(axes[1], time, outcome.temperature)
        if loaded:
            axes[2].plot(time, 1e3 * course.load[::SHOWN_EVERY], color=BLACK)
            axes[2].set_ylabel("load [g]")
        axes[-1].set_xlabel("time [s]")
        axes[-1].set_xlim(time[0], time[-1])
        fig.align_ylabels(list(axes))
    return fig


def responses_figure(result: Robustness) -> Figure:
    """Angle in every scenario, a panel each: setpoint, median and bands over the draws.

    Args:
        result: of gains that were judged, by `muscle_bayes.control.study.robustness`.

    Returns:
        A matplotlib figure: angle [deg] over time [s].
    """
    courses = result.scenarios
    columns = min(3, len(courses))
    rows = -(-len(courses) // columns)
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 0.5 + 1.5 * rows))
        axes: Any = fig.subplots(rows, columns, squeeze=False)
        for axis, one in zip(axes.flat, courses, strict=False):
            setpoint = np.asarray(one.course.setpoint[::SHOWN_EVERY])
            _angle(axis, result.time(one.name), result.outcomes[one.name].angle, setpoint)
            axis.get_legend().remove()
            axis.set_title(one.name, fontsize=8)
            axis.set_ylabel("")
        for axis in axes.flat[len(courses) :]:
            axis.set_axis_off()
        for axis in axes[:, 0]:
            axis.set_ylabel(r"$\theta$ [deg]")
        for axis in axes[-1]:
            axis.set_xlabel("time [s]")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        fig.legend(handles, labels, loc="outside lower left", ncols=4)
    return fig


def _title(result: Robustness, scenario: Scenario) -> str:
    found = result.summary()[scenario.name]
    return (
        f"{scenario.about}: {result.gains.law}, {result.draws} simulated draws\n"
        f"probability of instability {found['unstable']['probability']:.0%}, "
        f"of leaving {SAFE_TEMPERATURE:g} °C {found['unsafe']['probability']:.0%}"
    )


def _angle(axis: Axes, time: np.ndarray, angle: np.ndarray, setpoint: np.ndarray) -> None:
    finite = angle[np.isfinite(angle).all(axis=1)]
    if finite.size:
        draw_bands(axis, time, np.degrees(finite), "draws")
        axis.plot(time, np.degrees(np.median(finite, axis=0)), color=BLUE, label="median")
    axis.plot(time, np.degrees(setpoint), color=BLACK, linestyle=(0, (4, 2)), label="setpoint")
    axis.set_ylabel(r"$\theta$ [deg]")
    axis.legend(ncols=4, **_LEGEND)


def _temperatures(axis: Axes, time: np.ndarray, temperature: np.ndarray) -> None:
    finite = temperature[np.isfinite(temperature).all(axis=(1, 2))]
    for side, colour in enumerate((VERMILLION, SKY)):
        low, middle, high = np.quantile(finite[:, :, side], [0.05, 0.5, 0.95], axis=0)
        axis.fill_between(time, low, high, color=colour, alpha=0.3, linewidth=0)
        axis.plot(time, middle, color=colour, label=f"muscle {'AB'[side]}, median and 90 %")
    if finite.size and finite.max() > 0.9 * SAFE_TEMPERATURE:
        axis.axhline(SAFE_TEMPERATURE, color=GREY, linestyle=":", label="allowed")
    axis.set_ylabel("temperature [°C]")
    axis.legend(ncols=3, **_LEGEND)


def runaway_figure(curve: RunawayCurve) -> Figure:
    """How well setpoint sines are followed, and how probable runaway is, against frequency."""
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 2.8))
        above, below = fig.subplots(2, sharex=True)
        low, middle, high = curve.error.T
        above.fill_between(curve.frequency, low, high, color=SKY, alpha=0.4, linewidth=0)
        above.plot(curve.frequency, middle, color=BLUE, marker="o", label="median and 90 %")
        above.axhline(1.0, color=GREY, linestyle=":", label="a joint that stays at zero")
        above.set_ylabel("RMS error / RMS setpoint")
        above.legend(ncols=2, **_LEGEND)
        below.plot(
            curve.frequency, curve.unstable, color=VERMILLION, marker="s", label="adds error"
        )
        below.plot(curve.frequency, curve.unsafe, color=ORANGE, marker="o", label="too hot")
        below.set(ylabel="probability", ylim=(-0.03, 1.03), xlabel="frequency of the setpoint [Hz]")
        below.set_xscale("log")
        below.legend(ncols=2, **_LEGEND)
    return fig
