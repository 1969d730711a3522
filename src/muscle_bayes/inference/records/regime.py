"""Which equation of motion a run is solved by."""

from typing import Literal

from muscle_bayes.data.run import Run

Regime = Literal["fast", "slow", "imposed", "heated"]
REGIMES: tuple[Regime, ...] = ("fast", "slow", "imposed", "heated")
"""In the order in which lanes are stacked."""


def regime_of(run: Run) -> Regime:
    """heated: a thermometer shows what a heater's power makes of a temperature; imposed: the coordinate is
    as logged and a force is measured; slow: heat drives the rotor,
    through a muscle, and its inertia is left out; fast: with full inertia.

    A muscle changes over seconds to minutes, the rotor swings in fractions of a second; spring
    and free runs without a muscle are driven by the rotor's own inertia.
    """
    if run.measured == "temperature":
        return "heated"
    if run.measured == "force":
        return "imposed"
    return "slow" if run.has_muscle else "fast"
