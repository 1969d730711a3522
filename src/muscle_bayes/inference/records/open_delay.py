"""Thermometers whose delay their metadata leave open: fits estimate what it is off by."""

from collections.abc import Sequence

import numpy as np
from numpyro import distributions as dist

from muscle_bayes.data.run import Run
from muscle_bayes.physics.effects.sensing.clock_offset import ClockOffset

_PARAMETER = f"{ClockOffset.name}.delay"


UNSTATED = 1.0
"""Standard uncertainty of a delay of which the metadata say nothing, s."""


def delay_uncertainty(runs: Sequence[Run]) -> float:
    """Largest standard uncertainty [s] of the delay with which muscles' temperatures were logged."""
    return max((_uncertainty(run) for run in runs if _is_told(run)), default=0.0)


def _uncertainty(run: Run) -> float:
    meter = run.metadata.thermometer
    if meter is None or (meter.delay is None and meter.delay_uncertainty == 0.0):
        return UNSTATED
    return meter.delay_uncertainty


def _is_told(run: Run) -> bool:
    """Whether a thermometer shows the temperature of a muscle, and it changes."""
    about = run.metadata
    sides = [side for side in "ab" if getattr(about, f"element_{side}").kind == "muscle"]
    return any(
        not about.is_heated_by_power(side) and np.ptp(run.table[f"temperature_{side}"]) > 0.0
        for side in sides
    )


def with_open_delay(runs: Sequence[Run], effects: Sequence[str]) -> tuple[str, ...]:
    """The effects, and `clock-offset` where these runs leave the delay uncertain."""
    known = ClockOffset.name in effects or delay_uncertainty(runs) == 0.0
    return tuple(effects) if known else (*effects, ClockOffset.name)


def delay_prior(runs: Sequence[Run]) -> dict[str, dist.Distribution]:
    """Normal prior of what the delay is off by, as wide as the metadata leave it; none if it is known."""
    spread = delay_uncertainty(runs)
    return {_PARAMETER: dist.Normal(0.0, spread)} if spread > 0.0 else {}
