"""A window that draws a run while it grows: `python -m muscle_bayes.bench.recording.live_plot DIR NAME...`.

It only reads the run's files, so it can be opened, closed or killed at any moment of a recording.
"""

import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from muscle_bayes.bench.boards.messages import explain
from muscle_bayes.bench.recording.live import clock
from muscle_bayes.data import Run, read_run
from muscle_bayes.data.events import read_events
from muscle_bayes.errors import MuscleBayesError

PERIOD: Final = 1.0
"""s between drawings."""
SHOWN: Final = 600.0
"""Newest part of the run that is drawn, s."""
SILENT: Final = 5.0
"""Age of a log from which it is no longer being written, s."""
_COLOURS: Final = {"a": "#D55E00", "b": "#0072B2"}


def newest(folder: Path, names: list[str]) -> Path | None:
    """The log among those of these names, or later attempts at them, that was written last."""
    logs = [log for name in names for log in folder.glob(f"{name}*.csv")]
    return max(logs, key=lambda log: log.stat().st_mtime, default=None)


def draw(
    figure: Any, run: Run, events: Sequence[dict[str, Any]] = (), *, running: bool = True
) -> None:
    """Angle, temperatures and duties of a run's newest part, over what its events tell.

    `running`: whether rows are still being written.
    """
    table = run.table[run.table["time"] > run.duration - SHOWN]
    figure.clear()
    angle, temperature, duty = figure.subplots(3, sharex=True, height_ratios=(3, 3, 1.4))
    angle.plot(table["time"], run.coordinate[-len(table) :], color="black", linewidth=0.9)
    angle.set_ylabel("angle [rad]")
    for side, colour in _COLOURS.items():
        name = side.upper()
        shown = table[f"temperature_{side}"]
        element = getattr(run.metadata, f"element_{side}")
        setpoint = table[f"setpoint_{side}"].where(table[f"setpoint_{side}"] > 0)
        if element.kind == "muscle" or setpoint.notna().any():
            label = f"{name}: {shown.iloc[-1]:.1f} °C"
            temperature.plot(table["time"], shown, color=colour, linewidth=1.1, label=label)
        if setpoint.notna().any():
            label = f"setpoint {name}"
            temperature.plot(
                table["time"], setpoint, color=colour, linestyle="--", linewidth=0.9, label=label
            )
        duty.plot(table["time"], table[f"duty_{side}"], color=colour, linewidth=0.7)
    blown = table["fan"] == 1
    if blown.any():
        duty.fill_between(table["time"], 0, 255, where=blown, color="0.85", step="post")
        duty.text(0.01, 0.85, "grey: fan", transform=duty.transAxes, fontsize="small", va="top")
    duty.set_ylim(-5, 260)
    duty.set_ylabel("duty [0-255]")
    temperature.set_ylabel("temperature [°C]")
    duty.set_xlabel("time [s]")
    temperature.legend(loc="upper left", fontsize="small")
    figure.suptitle(_state(run, events, running), fontsize="medium")
    if trouble := _trouble(run, events):
        angle.set_title(trouble, color="#B00020", fontsize="medium", wrap=True)


def _state(run: Run, events: Sequence[dict[str, Any]], running: bool) -> str:
    """Where the run stands, in a line."""
    parts = [run.name, clock(run.duration)]
    stages = [event for event in events if event.get("event") == "stage"]
    ends = [event for event in events if event.get("event") == "end"]
    if ends:
        parts.append(f"over: {ends[-1].get('reason', '')}")
    elif not running:
        parts.append("no rows are written any more")
    elif stages:
        newest = stages[-1]
        since = run.duration - float(newest.get("time") or 0.0)
        parts.append(f"stage {newest.get('number')}: {newest.get('what')}")
        if (left := newest.get("to_go")) is not None:
            parts.append(f"about {clock(max(float(left) - since, 0.0))} to go")
    return ", ".join(parts)


def _trouble(run: Run, events: Sequence[dict[str, Any]]) -> str:
    """What is wrong now, empty if nothing."""
    told = run.table["faults"].dropna()
    if len(told) and told.iloc[-1]:
        return f"latched: {explain(int(told.iloc[-1]))}"
    for event in reversed(events):
        if event.get("event") in ("trouble over", "end"):
            return ""
        if event.get("event") == "trouble":
            return "heaters off: " + "; ".join(map(str, event.get("what", ())))
    return ""


def main(folder: Path, names: list[str]) -> None:
    """Draw until the window is closed."""
    from matplotlib import pyplot

    figure = pyplot.figure("muscle-bayes record", figsize=(9, 7), layout="constrained")
    while pyplot.fignum_exists(figure.number):
        with suppress(MuscleBayesError):  # too few rows yet
            if (log := newest(folder, names)) is not None:
                running = time.time() - log.stat().st_mtime < SILENT
                draw(figure, read_run(log), read_events(log), running=running)
        pyplot.pause(PERIOD)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
