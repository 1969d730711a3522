"""Drift of HYST at room temperature: how the rotor creeps while a muscle is cold after heating."""

from dataclasses import asdict, dataclass
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from muscle_bayes.criticism.coverage import judged_unit
from muscle_bayes.errors import refuse_all_but
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
END_SHARE = 0.15
"""Share of a phase's readings averaged at either end for the shift; at least two."""

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """A number with the 5 and 95 % quantiles of what it may be."""

    mean: float
    q05: float
    q95: float

    @classmethod
    def of(cls, draws: Values) -> "Estimate":
        low, high = np.quantile(draws, [0.05, 0.95])
        return cls(float(draws.mean()), float(low), float(high))


@dataclass(frozen=True)
class Creep:
    """One measure of a phase's creep, measured and predicted."""

    measured: float
    standard_error: float
    predicted: Estimate
    """what the model gives: uncertainty of the parameters only"""
    difference: Estimate
    """measured - predicted, uncertainty of both"""


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
    return median_filter(temperature, 3, mode="nearest")


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


def inflation(residual: Values) -> float:
    """Factor by which autocorrelation of lag one, r, widens errors: sqrt((1 + r)/(1 - r)) >= 1."""
    power = float(residual @ residual)
    if power == 0.0:
        return 1.0
    r = min(max(float(residual[1:] @ residual[:-1]) / power, 0.0), 0.9)
    return float(np.sqrt((1.0 + r) / (1.0 - r)))


def _slope_weights(time: Values) -> Values:
    """w with w . y the least-squares slope of y over time, per minute."""
    centred = (time - time.mean()) / 60.0
    return centred / float(centred @ centred)


def _shift_weights(time: Values) -> Values:
    """w with w . y the mean of the last readings minus the mean of the first."""
    ends = max(2, round(END_SHARE * time.size))
    weights = np.zeros(time.size)
    weights[:ends], weights[-ends:] = -1.0 / ends, 1.0 / ends
    return weights


def _creep(weights: Values, observed: Values, model: Values, noise: float, wobble: Values):
    """One linear measure of the readings; `noise` is the effective error of a single reading.

    Also returns the draws of its difference, which phases share and must be averaged draw by draw.
    """
    measured = float(weights @ observed)
    error = noise * float(np.linalg.norm(weights))
    predicted = model @ weights
    difference = measured - predicted + error * wobble
    return Creep(measured, error, Estimate.of(predicted), Estimate.of(difference)), difference


def _phase(prediction: Prediction, own: slice, wobble: Values) -> tuple[ColdPhase, Values]:
    factor = judged_unit(prediction)[1]
    time = prediction.time[own]
    observed, model = factor * prediction.observed[own], factor * prediction.model[:, own]
    # Creep bends as it slows down; the model's own bend keeps that from passing for noise.
    misfit = observed - model.mean(axis=0)
    residual = misfit - np.polynomial.Polynomial.fit(time, misfit, 1)(time)
    noise = float(np.sqrt(residual @ residual / (time.size - 2))) * inflation(residual)
    slope, difference = _creep(_slope_weights(time), observed, model, noise, wobble)
    shift, _ = _creep(_shift_weights(time), observed, model, noise, wobble)
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
    refuse_all_but(Prediction, prediction, "prediction", "give one of those that `predict` returns")
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
