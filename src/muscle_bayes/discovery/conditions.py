"""What was going on while a reading was taken: the signals by which a misfit is described."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from muscle_bayes.discovery.fitted import Fitted, whole_weights
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.nested_programs import values_of
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
HEATED = 1.0
"""Range of temperature from which on a run is one of a heated muscle, C."""


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


def traces(nested: Nested, fitted: Fitted, whole: bool = False) -> list[Trace]:
    """Residuals and signals of every run at a fitted point, held-out parts only if `whole`."""
    problem, layout = nested.problem, nested.layout
    data = whole_weights(nested, fitted.data) if whole else fitted.data
    values = values_of(fitted.point, fitted.choice, layout, data)
    pieces: dict[int, list[dict[str, np.ndarray]]] = {}
    start = 0
    for group, (lanes, regime, owners) in enumerate(
        zip(data.lanes, layout.regimes, problem.lane_runs, strict=True)
    ):
        residuals = np.asarray(fitted.seen.residuals[group])
        hyst = np.asarray(fitted.seen.hyst[group])
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
    """Number of the heating cycle, from 1: each begins where temperature rises through half its range."""
    middle = temperature.min() + 0.5 * np.ptp(temperature)
    above = temperature > middle
    return 1.0 + np.maximum(np.cumsum(np.r_[above[0], above[1:] & ~above[:-1]]) - 1.0, 0.0)


def is_settled(
    time: Float[np.ndarray, " interval"],
    load: Float[np.ndarray, " interval"],
    temperature: Float[np.ndarray, " interval"],
    settling: float = 30.0,
) -> Bool[np.ndarray, " interval"]:
    """Intervals before the first change of load [kg], and more than `settling` s after the last one."""
    changes = np.flatnonzero(np.diff(load)) + 1
    if np.ptp(temperature) <= HEATED or changes.size == 0:
        return np.ones(time.shape, bool)
    last = np.searchsorted(changes, np.arange(time.size), side="right") - 1
    return (last < 0) | (time - time[changes[np.maximum(last, 0)]] > settling)


def where(
    trace: Trace,
    excess: Float[np.ndarray, " interval"],
    inside: slice,
    share: float = 0.7,
    contrast: float = 0.15,
) -> str:
    """One condition or two that hold `share` of a window's excess in few of the run's readings.

    The best by share of excess minus share of readings; "throughout" where that is below `contrast`.
    """
    weight = np.zeros(trace.time.size)
    weight[inside] = np.maximum(excess[inside], 0.0)
    if weight.sum() <= 0.0:
        return "throughout"
    weight /= weight.sum()
    single = [
        (_contrast(mask, weight), name, mask)
        for name, mask in _conditions(trace)
        if mask @ weight > share
    ]
    single.sort(key=lambda one: -one[0])
    best = single[0] if single and single[0][0] > contrast else None
    if best is None:
        return "throughout"
    for first, second in combinations(single[:12], 2):
        if first[1].split()[0] == second[1].split()[0]:
            continue
        both = first[2] & second[2]
        if both @ weight > share and _contrast(both, weight) > best[0] + contrast / 3:
            best = (_contrast(both, weight), f"{first[1]} and {second[1]}", both)
    return best[1]


def _contrast(mask: Bool[np.ndarray, " interval"], weight: np.ndarray) -> float:
    return float(mask @ weight - mask.mean())


def _conditions(trace: Trace) -> list[tuple[str, Bool[np.ndarray, " interval"]]]:
    found = []
    for name, signal in trace.signals.items():
        if np.ptp(signal) <= 0.0:
            continue
        unit = f" {SIGNALS[name]}" if SIGNALS[name] else ""
        for text in sorted(
            {_rounded(name, x) for x in np.quantile(signal, np.linspace(0.1, 0.9, 9))} | {"0"}
        ):
            level = float(text)
            if signal.min() < level < signal.max():
                found.append((f"{name} > {text}{unit}", signal > level))
                found.append((f"{name} < {text}{unit}", signal < level))
    return found


def _rounded(name: str, level: float) -> str:
    """A threshold in two figures, whole numbers for cycles."""
    return f"{round(level)}" if name == "cycle" else f"{float(f'{level:.2g}'):g}"
