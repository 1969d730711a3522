"""What was going on while a reading was taken: the signals by which a misfit is described."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from muscle_bayes.discovery.settling import HEATED
from muscle_bayes.inference.search.descent import Fitted
from muscle_bayes.inference.search.nested import Nested, values_at
from muscle_bayes.physics.elements import Muscle

SIGNALS: dict[str, str] = {
    "T": "C",
    "dT/dt": "C/s",
    "load": "kg",
    "angle": "rad",
    "position": "m",
    "speed": "rad/s",
    "velocity": "m/s",
    "sigma": "",
    "sigma_hyst": "",
    "cycle": "",
    "time since load change": "s",
}
"""Names and units of signals, as the misfit map writes them."""
WARM = 0.5
"""A cycle begins where temperature rises through this share of its range."""


@dataclass(frozen=True)
class Trace:
    """One run, interval by interval, only where it was observed."""

    run: str
    unit: str
    time: Float[np.ndarray, " interval"]
    duration: Float[np.ndarray, " interval"]
    """Length of each interval [s]."""
    residual: Float[np.ndarray, " interval"]
    """Reading minus model [unit]."""
    place: Float[np.ndarray, " interval"]
    """Where the run's intervals stand among all standardised errors."""
    segment: Int[np.ndarray, " interval"]
    """The same for all intervals of a segment, whose start is integrated out; else each its own."""
    signals: Mapping[str, Float[np.ndarray, " interval"]]

    def only(self, chosen: Bool[np.ndarray, " interval"]) -> "Trace":
        """The chosen intervals."""
        arrays = ("time", "duration", "residual", "place", "segment")
        cut = {key: getattr(self, key)[chosen] for key in arrays}
        return replace(self, **cut, signals={k: v[chosen] for k, v in self.signals.items()})


def traces(nested: Nested, fitted: Fitted) -> list[Trace]:
    """Residuals and signals of every run at a fitted point."""
    problem, data, layout = nested.problem, nested.data, nested.layout
    values = values_at(jnp.asarray(fitted.point), fitted.choice, layout, data)
    pieces: dict[int, list[dict[str, np.ndarray]]] = {}
    start = 0
    for group, (lanes, regime, owners) in enumerate(
        zip(data.lanes, layout.regimes, problem.lane_runs, strict=True)
    ):
        residuals = np.asarray(fitted.found.residuals[group])
        hyst = np.asarray(fitted.found.hyst[group])
        zero = values.get(f"{regime}.zero")
        for lane, owner in enumerate(owners):
            one = jax.tree.map(lambda x, lane=lane: np.asarray(x)[lane], lanes)
            seen, cut = one.weight > 0, layout.segmented[group]
            own = 0.0 if zero is None or cut else float(zero[one.run])
            q = one.scale * (one.reading - residuals[lane] - own)
            piece = {"place": start + np.flatnonzero(seen), "residual": residuals[lane][seen]}
            piece["segment"] = np.full(seen.sum(), start) if cut else piece["place"]
            piece |= {"time": one.time[seen], "q": q[seen], "hyst": hyst[lane][seen]}
            piece["duration"] = np.diff(one.schedule.time)[seen]
            piece["load"] = one.schedule.load[seen]
            piece["temperature"] = one.schedule.temperature[1:, 0][seen]
            piece["sigma"] = _strain(one.plant, q)[seen]
            pieces.setdefault(owner, []).append(piece)
            start += one.weight.size
    return [_trace(nested, owner, pieces[owner]) for owner in sorted(pieces)]


def _strain(plant, q: Float[np.ndarray, " interval"]) -> Float[np.ndarray, " interval"]:
    if not isinstance(plant.side_a, Muscle):
        return np.zeros_like(q)
    return np.asarray(jax.vmap(plant.side_a.strain)(jnp.asarray(q)))


def _trace(nested: Nested, owner: int, parts: list[dict[str, np.ndarray]]) -> Trace:
    run = nested.problem.runs[owner]
    joined = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    time, q, load = joined["time"], joined["q"], joined["load"]
    linear = run.metadata.fixture.motion == "linear"
    signals = {"position" if linear else "angle": q}
    signals["velocity" if linear else "speed"] = _rate(q, time)
    if np.ptp(load) > 0:
        since = np.flatnonzero(np.r_[False, np.diff(load) != 0])
        last = np.searchsorted(since, np.arange(time.size), side="right") - 1
        begun = np.where(last >= 0, time[since[np.maximum(last, 0)]], time[0])
        signals["time since load change"] = time - begun
    signals["load"] = load
    temperature = joined["temperature"]
    if np.ptp(temperature) > HEATED:
        signals |= {"T": temperature, "dT/dt": _rate(temperature, time)}
        signals["cycle"] = _cycles(temperature)
    if np.ptp(joined["sigma"]) > 0.0:
        signals |= {"sigma": joined["sigma"], "sigma_hyst": joined["hyst"]}
    return Trace(
        run.name,
        run.unit,
        time,
        joined["duration"],
        joined["residual"],
        joined["place"].astype(int),
        joined["segment"].astype(int),
        signals,
    )


def _rate(values: np.ndarray, time: np.ndarray) -> np.ndarray:
    return np.gradient(values, time) if time.size > 1 else np.zeros_like(values)


def _cycles(temperature: np.ndarray) -> np.ndarray:
    """Number of the heating cycle, from 1."""
    middle = temperature.min() + WARM * np.ptp(temperature)
    above = temperature > middle
    return 1.0 + np.maximum(np.cumsum(np.r_[above[0], above[1:] & ~above[:-1]]) - 1.0, 0.0)
