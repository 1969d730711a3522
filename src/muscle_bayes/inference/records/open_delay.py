"""Thermometers whose delay their metadata leave uncertain: fits estimate what it is off by."""

from collections.abc import Sequence

from numpyro import distributions as dist

from muscle_bayes.data.run import Run
from muscle_bayes.inference.records.rig import has_muscle
from muscle_bayes.physics.effects.clock_offset import ClockOffset

_PARAMETER = f"{ClockOffset.name}.delay"


def delay_uncertainty(runs: Sequence[Run]) -> float:
    """Largest standard uncertainty [s] of the delay with which muscles' temperatures were logged."""
    meters = [run.metadata.thermometer for run in runs if has_muscle(run)]
    return max((meter.delay_uncertainty for meter in meters if meter is not None), default=0.0)


def with_open_delay(runs: Sequence[Run], effects: Sequence[str]) -> tuple[str, ...]:
    """The effects, and `clock-offset` where these runs leave the delay uncertain."""
    known = ClockOffset.name in effects or delay_uncertainty(runs) == 0.0
    return tuple(effects) if known else (*effects, ClockOffset.name)


def delay_prior(runs: Sequence[Run]) -> dict[str, dist.Distribution]:
    """Normal prior of what the delay is off by, as wide as the metadata say; none if they do not."""
    spread = delay_uncertainty(runs)
    return {_PARAMETER: dist.Normal(0.0, spread)} if spread > 0.0 else {}
