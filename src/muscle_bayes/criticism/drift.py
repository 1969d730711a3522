"""Drift of HYST at room temperature: how the rotor creeps while a muscle is cold after heating."""

from dataclasses import asdict, dataclass
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from muscle_bayes.criticism.creep import (
    Creep,
    Estimate,
    creep,
    inflation,
    shift_weights,
    slope_weights,
)
from muscle_bayes.criticism.units import judged_unit
from muscle_bayes.inference.posteriors.predict import Prediction

COLD_BAND = 3.0
"""Cold is within this of the run's coldest settled temperature, C."""
SETTLED_SHARE = 0.02
"""The coldest settled temperature is this quantile of the run's smoothed temperatures."""
HEATED_RISE = 15.0
"""The muscle counts as heated once it has been this much above the coldest temperature, C."""
SHORTEST = 30.0
"""Shortest cold phase, s."""
FEWEST = 6
"""Fewest readings of a cold phase: a slope and the correlation of its residuals take some."""

Values = NDArray[np.float64]


@dataclass(frozen=True)
class ColdPhase:
    """One cold phase."""

    start: float
    """s"""
    end: float
    """s"""
    readings: int
    temperature: float
    """mean, C"""
    load: float
    """kg"""
    slope: Creep
    """[deg/min, or mm/min where motion is linear]"""
    shift: Creep
    """end minus start [deg or mm]"""


@dataclass(frozen=True, repr=False)
class Drift:
    """Creep in all cold phases of a run. Without phases, `reason` tells why there are none."""

    run: str
    unit: str
    """deg or mm; slopes are per minute"""
    phases: tuple[ColdPhase, ...]
    slope_difference: Estimate | None
    """mean over the phases of measured - predicted slope [unit/min]"""
    reason: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers."""
        return asdict(self)

    def __repr__(self) -> str:
        if self.slope_difference is None:
            return f"Drift({self.run}: none, {self.reason})"
        d = self.slope_difference
        return (
            f"Drift({self.run}: {len(self.phases)} cold phases, measured - predicted "
            f"{d.mean:+.3g} [{d.q05:+.3g}, {d.q95:+.3g}] {self.unit}/min)"
        )

    def _repr_html_(self) -> str:
        unit = escape(self.unit)
        header = (
            f"<th>from [s]<th>to [s]<th>load [kg]<th>measured [{unit}/min]<th>predicted"
            "<th>difference, 90 %"
        )
        rows = "".join(
            f"<tr><td>{p.start:.4g}<td>{p.end:.4g}<td>{p.load:.3g}<td>{p.slope.measured:.3g}"
            f"<td>{p.slope.predicted.mean:.3g}<td>{p.slope.difference.mean:+.3g} "
            f"[{p.slope.difference.q05:+.3g}, {p.slope.difference.q95:+.3g}]</tr>"
            for p in self.phases
        )
        return f"<p>{escape(repr(self))}</p><table><tr>{header}</tr>{rows}</table>"


def _smoothed(temperature: Values) -> Values:
    """Median of three: one stray reading neither ends a phase nor counts as heat."""
    padded = np.pad(temperature, 1, mode="edge")
    return np.median(np.stack([padded[:-2], padded[1:-1], padded[2:]]), axis=0)


def cold_phases(prediction: Prediction) -> list[slice]:
    """Longest stretches of SHORTEST s or more, cold, with one load, after a first heating."""
    temperature = _smoothed(prediction.temperature)
    coldest = float(np.quantile(temperature, SETTLED_SHARE))
    heated = np.maximum.accumulate(temperature) > coldest + HEATED_RISE
    cold = heated & (temperature < coldest + COLD_BAND)
    changes = np.r_[True, (cold[1:] != cold[:-1]) | (np.diff(prediction.load) != 0.0)]
    starts = np.flatnonzero(changes)
    ends = np.r_[starts[1:], cold.size]
    return [
        slice(first, last)
        for first, last in zip(starts, ends, strict=True)
        if cold[first]
        and last - first >= FEWEST
        and prediction.time[last - 1] - prediction.time[first] >= SHORTEST
    ]


def _phase(prediction: Prediction, own: slice, wobble: Values) -> tuple[ColdPhase, Values]:
    factor = judged_unit(prediction)[1]
    time = prediction.time[own]
    observed, model = factor * prediction.observed[own], factor * prediction.model[:, own]
    # Creep bends as it slows down; the model's own bend keeps that from passing for noise.
    misfit = observed - model.mean(axis=0)
    residual = misfit - np.polynomial.Polynomial.fit(time, misfit, 1)(time)
    noise = float(np.sqrt(residual @ residual / (time.size - 2))) * inflation(residual)
    slope, difference = creep(slope_weights(time), observed, model, noise, wobble)
    shift, _ = creep(shift_weights(time), observed, model, noise, wobble)
    phase = ColdPhase(
        start=float(time[0]),
        end=float(time[-1]),
        readings=time.size,
        temperature=float(prediction.temperature[own].mean()),
        load=float(prediction.load[own][0]),
        slope=slope,
        shift=shift,
    )
    return phase, difference


def drift(prediction: Prediction, seed: int = 0) -> Drift:
    """Measured against predicted slope and shift of every cold phase of a run.

    The slope is fitted by least squares; its standard error comes from the scatter of observed
    minus mean model about a line, widened for autocorrelation. Positive is the direction of the
    rotor's coordinate.

    Args:
        prediction: of one run, as `predict` gives it.
        seed: of the random numbers.

    Returns:
        Slopes [deg/min or mm/min] and shifts of every cold phase, measured and predicted, and the
        mean difference of slopes; `reason` says why there is none.

    Example:
        >>> import muscle_bayes as mb
        >>> runs = mb.load_example("springs")
        >>> posterior = mb.fit(runs, effort="quick", progress=False)
        >>> prediction = mb.predict(posterior, runs, draws=50)[0]
        >>> mb.drift(prediction).reason  # a spring is not heated
        'the temperature never rises by 15 C'
    """
    unit = judged_unit(prediction)[0]
    if np.ptp(_smoothed(prediction.temperature)) < HEATED_RISE:
        reason = f"the temperature never rises by {HEATED_RISE:g} C"
        return Drift(prediction.run, unit, (), None, reason)
    found = cold_phases(prediction)
    if not found:
        reason = (
            f"no {SHORTEST:g} s with at least {FEWEST} readings lie within {COLD_BAND:g} C "
            "of the coldest temperature after a heating"
        )
        return Drift(prediction.run, unit, (), None, reason)
    rng = np.random.default_rng(seed)
    draws = prediction.model.shape[0]
    results = [_phase(prediction, own, rng.standard_normal((draws,))) for own in found]
    overall = Estimate.of(np.mean([difference for _, difference in results], axis=0))
    return Drift(prediction.run, unit, tuple(phase for phase, _ in results), overall)
