"""A run as logged: position, temperatures, load and applied force over time."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from muscle_bayes.data.run import Run, refuse_unread
from muscle_bayes.data.units import SI_OF_DRIVE
from muscle_bayes.report.style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SKY,
    VERMILLION,
    WIDTH,
    mark_origin,
    quiet_style,
)

_SIDE_COLOURS = {"a": VERMILLION, "b": SKY}
HEATED = 2.0
"""Span of temperatures below which only noise would be drawn, C."""
_MEDIAN_SPAN = 1.0
"""Span of the running median drawn over the temperatures, s."""


def run_figure(run: Run) -> Figure:
    """A run in panels; those of quantities that it does not have are left out.

    Args:
        run: as `read_runs` gives it.

    Returns:
        A matplotlib figure: readings and forces [the log's units], temperature, load, heater, drive.
    """
    refuse_unread([run])
    table, columns = run.table, run.metadata.columns
    held = columns is not None and columns.position is None
    panels: list[tuple[Callable[[Axes, Run], None], float]] = [] if held else [(_position, 2.0)]
    if run.has_force:
        panels.append((_force, 1.5))
    if any(np.ptp(table[f"temperature_{side}"]) > HEATED for side in "ab"):
        panels.append((_temperature, 1.5))
    if table["load"].nunique() > 1:  # a constant load is told in the title
        panels.append((_load, 0.8))
    if any(run.metadata.is_heated_by_power(side) for side in "ab"):
        panels.append((_power, 1.2))
    if table["applied"].any():
        panels.append((_applied, 1.2))
    heights = [height for _, height in panels]
    with quiet_style():
        fig = Figure(figsize=(WIDTH, 0.6 + 0.8 * sum(heights)))
        axes = fig.subplots(len(panels), sharex=True, squeeze=False, height_ratios=heights)[:, 0]
        for axis, (draw, _) in zip(axes, panels, strict=True):
            draw(axis, run)
            _mark_gaps(axis, run)
            axis.margins(x=0.01)
        axes[0].set_title(_title(run))
        axes[-1].set_xlabel("time [s]")
        fig.align_ylabels(list(axes))
        mark_origin(fig, run.metadata.origin)
    return fig


def _title(run: Run) -> str:
    loads = run.table["load"]
    load = f", load {loads[0] * 1e3:.4g} g" if loads[0] > 0 and loads.nunique() == 1 else ""
    return f"{run.name}: {run.metadata.protocol} run{load}"


def _position(axis: Axes, run: Run) -> None:
    axis.plot(run.table["time"], run.table["reading"], color=BLACK, linewidth=0.9)
    for step in run.load_steps:
        axis.axvline(step, color=GREY, linewidth=0.8, linestyle=":")
    axis.set_ylabel(f"{run.measured} reading [{run.unit}]")
    sensor = run.output_sensor
    linear = run.metadata.fixture.motion == "linear"
    per_unit, label = (1e3, "x [mm]") if linear else (180.0 / np.pi, r"$\theta$ [deg]")
    if run.measured == "velocity":
        label = "v [mm/s]" if linear else r"$\omega$ [deg/s]"
    second = axis.secondary_yaxis(
        "right",
        functions=(
            lambda reading: sensor.coordinate(reading) * per_unit,
            lambda shown: sensor.reading(np.asarray(shown) / per_unit),
        ),
    )
    second.set_ylabel(label)


def _temperature(axis: Axes, run: Run) -> None:
    """Readings pale, their running median over them: thermocouples are noisy."""
    time = run.table["time"]
    rows = max(1, round(_MEDIAN_SPAN / float(np.median(np.diff(time)))))
    for side, colour in _SIDE_COLOURS.items():
        if not run.has_thermometer(side):
            continue
        reading, setpoint = run.table[f"temperature_{side}"], run.table[f"setpoint_{side}"]
        smooth = reading.rolling(rows, center=True, min_periods=1).median()
        axis.plot(time, reading, color=colour, linewidth=0.4, alpha=0.35)
        axis.plot(time, smooth, color=colour, linewidth=1.3, label=f"temperature {side.upper()}")
        if setpoint.max() > 0:
            axis.plot(
                time,
                setpoint,
                color=BLACK if side == "a" else BLUE,
                linewidth=0.9,
                linestyle=(0, (4, 2)),
                drawstyle="steps-post",
                label=f"setpoint {side.upper()}",
            )
    axis.set_ylabel("temperature [°C]")
    axis.legend(loc="lower left", bbox_to_anchor=(0.0, 0.98), ncols=4, borderaxespad=0.0)


def _load(axis: Axes, run: Run) -> None:
    axis.plot(run.table["time"], run.table["load"] * 1e3, color=BLUE, drawstyle="steps-post")
    axis.set_ylabel("load [g]")
    axis.set_ylim(bottom=0)


def _force(axis: Axes, run: Run) -> None:
    axis.plot(run.table["time"], run.table["force"], color=BLACK, linewidth=0.9)
    axis.set_ylabel(f"force [{run.metadata.force_unit}]")


def _power(axis: Axes, run: Run) -> None:
    for side, colour in _SIDE_COLOURS.items():
        if run.metadata.is_heated_by_power(side):
            axis.plot(run.table["time"], run.table[f"power_{side}"], color=colour, linewidth=0.8)
    axis.set_ylabel(f"heater [{SI_OF_DRIVE[run.metadata.power_unit.kind]}]")


def _applied(axis: Axes, run: Run) -> None:
    axis.plot(run.table["time"], run.table["applied"], color=ORANGE, linewidth=0.8)
    axis.set_ylabel(f"applied [{SI_OF_DRIVE[run.metadata.drive_unit.kind]}]")


def _mark_gaps(axis: Axes, run: Run) -> None:
    for start, end in run.gaps:
        axis.axvspan(start, end, color=GREY, alpha=0.25, linewidth=0)
