"""Whether what a run states can move the stated inertia as the readings move."""

import numpy as np

from muscle_bayes.data.run import Run
from muscle_bayes.inference.model.prior import reading_noise
from muscle_bayes.inference.records.rig import greatest_force, stated_inertia

SPANS = (1, 2, 4, 8)
"""Rows over which an acceleration is taken."""


def contradiction(
    run: Run, *, share: float = 0.99, doubt: float = 5.0, factor: float = 3.0
) -> str | None:
    """A sentence where readings accelerate more than the stated forces allow; None where they do not.

    Only where every force is stated or logged, and rows are evenly spaced.

    Args:
        run: as read.
        share: quantile of the accelerations that is looked at; impacts are rarer.
        doubt: standard deviations of reading noise that may be in it.
        factor: of the greatest force, beyond which friction and rounding are no excuse.
    """
    inertia, force = stated_inertia(run), greatest_force(run)
    step = np.diff(run.table["time"].to_numpy())
    usual = float(np.median(step))
    uneven = float(np.mean(np.abs(step - usual) > 0.2 * usual)) > 0.01
    if run.imposed is not None or run.measured != "position" or not inertia or not force or uneven:
        return None
    noise = reading_noise(run) * abs(run.output_sensor.scale)
    worst = 0.0
    for rows in SPANS:
        bends = np.abs(
            run.output[2 * rows :] - 2 * run.output[rows:-rows] + run.output[: -2 * rows]
        )
        sure = float(np.quantile(bends, share)) - doubt * np.sqrt(6.0) * noise
        worst = max(worst, sure / (rows * usual) ** 2)
    demand = inertia * worst
    if demand <= factor * force:
        return None
    linear = run.metadata.fixture.motion == "linear"
    length, unit = ("m", "N") if linear else ("rad", "N m")
    return (
        f"{run.name}: readings accelerate by {worst:.3g} {length}/s^2, which takes {demand:.3g} {unit} "
        f"with the stated inertia, but all that is stated and logged pulls with {force:.3g} {unit}: "
        "a mass, a length or the scale of what drives is contradicted"
    )
