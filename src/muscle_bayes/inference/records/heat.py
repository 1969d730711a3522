"""What heats a side of a run, at any time."""

import numpy as np
from jaxtyping import Float
from scipy.signal import lfilter

from muscle_bayes.data.run import Run
from muscle_bayes.inference.records.thermometer import course, course_variance

JUMP, MOST_JUMPS = 0.1, 100
"""Share of its range by which a power jumps at a row, and how often before it is averaged instead."""
COOLING_TIMES, WARMED = (3.0, 10.0, 30.0, 100.0), 60.0
"""Of bodies whose temperature nodes follow where a power heats [s], and by how much it rises [C]."""


def heating(run: Run, side: str) -> np.ndarray | None:
    """What heats a side, in each row: its power, or what that is proportional to; None: a thermometer
    shows the temperature."""
    if not run.metadata.is_heated_by_power(side):
        return None
    logged = run.table[f"power_{side}"].to_numpy()
    return logged**2 if run.metadata.power_unit.kind in ("current", "voltage") else logged


def is_held(run: Run, name: str) -> bool:
    """Whether a column's value holds until the next row; else it changes evenly to that of the next."""
    columns = run.metadata.columns
    return columns is not None and getattr(columns, f"{name}_held")


def integral(values: np.ndarray, time: np.ndarray, held: bool) -> np.ndarray:
    """Integral of a column over time, up to each row."""
    between = values[:-1] if held else 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[0.0], np.cumsum(between * np.diff(time))])


def heat_at(run: Run, side: str, nodes: np.ndarray) -> np.ndarray:
    """A side's temperature at the nodes [C]; of a side that power heats, that, its energy kept."""
    power, time = heating(run, side), run.table["time"].to_numpy()
    if power is None:
        return course(run.heat_time, run.table[f"temperature_{side}"].to_numpy(), nodes).value
    energy = integral(power, time, is_held(run, "power"))
    ends = np.concatenate([nodes[:1], 0.5 * (nodes[1:] + nodes[:-1]), nodes[-1:]])
    return np.diff(np.interp(ends, time, energy)) / np.diff(ends)


def bend_of_heat(run: Run, side: str, even: np.ndarray) -> np.ndarray:
    """Second derivative of a side's temperature at even times [C/s^2]."""
    power = heating(run, side)
    if power is None:
        logged = run.table[f"temperature_{side}"].to_numpy()
        return course(run.heat_time, logged, even).curvature
    # What heats turns into a temperature that is not known yet: of bodies that cool in such times.
    logged = np.interp(even, run.table["time"].to_numpy(), power)
    bends = []
    for cooling in COOLING_TIMES:
        share = 1.0 - np.exp(-(even[1] - even[0]) / cooling)
        warm = lfilter([share], [1.0, share - 1.0], logged)
        rate = np.gradient(warm, even) * WARMED / max(float(np.ptp(warm)), 1e-30)
        bends.append(np.abs(np.gradient(rate, even)))
    return np.max(bends, axis=0)


def switched(run: Run) -> np.ndarray:
    """Rows after which the power of a heater jumps; none where it does so all the time, as PWM does."""
    found = np.zeros(0, int)
    for side in "ab":
        if (power := heating(run, side)) is not None:
            jumps = np.flatnonzero(np.abs(np.diff(power)) > JUMP * np.ptp(power))
            found = np.union1d(found, jumps) if jumps.size <= MOST_JUMPS else found
    return found


def heat_variance(run: Run, nodes: np.ndarray) -> Float[np.ndarray, "interval 2"]:
    """Variance of both sides' temperature in each interval; 0 of a side without a muscle."""
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    sides = []
    for side in "ab":
        values = run.table[f"temperature_{side}"].to_numpy()
        muscle = getattr(run.metadata, f"element_{side}").kind == "muscle"
        if muscle and heating(run, side) is None:
            sides.append(course_variance(run.heat_time, values, middles))
        else:
            sides.append(np.zeros(nodes.size - 1))
    return np.stack(sides, 1)
