"""A window that draws a run while it grows: `python -m muscle_bayes.bench.recording.live_plot DIR NAME...`.

It only reads the run's files, so it can be opened, closed or killed at any moment of a recording.
"""

import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from muscle_bayes.data import Run, read_run
from muscle_bayes.errors import MuscleBayesError

PERIOD: Final = 1.0
"""s between drawings."""
SHOWN: Final = 600.0
"""Newest part of the run that is drawn, s."""


def newest(folder: Path, names: list[str]) -> Path | None:
    """The log among those of these names, or later attempts at them, that was written last."""
    logs = [log for name in names for log in folder.glob(f"{name}*.csv")]
    return max(logs, key=lambda log: log.stat().st_mtime, default=None)


def draw(figure: Any, run: Run) -> None:
    """Reading and temperatures of a run's newest part."""
    table = run.table[run.table["time"] > run.duration - SHOWN]
    figure.clear()
    above, below = figure.subplots(2, sharex=True)
    above.plot(table["time"], run.coordinate[-len(table) :], color="black", linewidth=0.9)
    above.set_ylabel("angle [rad]")
    above.set_title(f"{run.name}, {run.duration:.0f} s")
    for side, colour in (("a", "#D55E00"), ("b", "#56B4E9")):
        below.plot(table["time"], table[f"temperature_{side}"], color=colour, label=side.upper())
        setpoint = table[f"setpoint_{side}"].where(table[f"setpoint_{side}"] > 0)
        below.plot(table["time"], setpoint, color=colour, linestyle="--", linewidth=0.9)
    below.set_ylabel("temperature [°C]")
    below.set_xlabel("time [s]")
    below.legend(loc="upper left")


def main(folder: Path, names: list[str]) -> None:
    """Draw until the window is closed."""
    from matplotlib import pyplot

    figure = pyplot.figure("muscle-bayes record")
    while pyplot.fignum_exists(figure.number):
        with suppress(MuscleBayesError):  # too few rows yet
            if (log := newest(folder, names)) is not None:
                draw(figure, read_run(log))
        pyplot.pause(PERIOD)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
