"""Where the misfit is: windows of time whose errors exceed what noise and uncertain parameters allow."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.stats import gumbel_r, norm

from muscle_bayes.discovery.conditions import Trace, is_settled, traces, where
from muscle_bayes.discovery.fit import Fitted, Search, noise_names
from muscle_bayes.discovery.nominal import error_of_reading, noise_of_reading
from muscle_bayes.inference.model.likelihood import lasting_variance
from muscle_bayes.inference.model.noise import NoiseParameters
from muscle_bayes.inference.model.problem import TYPICAL_MISFIT_TIME
from muscle_bayes.inference.search.factored import FactoredPrecision
from muscle_bayes.inference.search.nested import Nested, values_at
from muscle_bayes.markup import html_table

LEAST_P = 1e-12
"""Smaller p-values are not told: no tail is known so far out."""
SIGNIFICANT = 0.0085
"""p-value, of all windows together, below which a misfit counts: odds of 9 at most against none."""


@dataclass(frozen=True)
class Located:
    """A window in which a run misfits."""

    run: str
    start: float
    """s"""
    end: float
    """s"""
    where: str
    """Conditions that hold most of the excess, such as `sigma < 0 and T > 80 C`."""
    rms: float
    """Of reading minus model [unit]."""
    unit: str
    p_value: float
    """Probability of so large an excess in any window of any run, were there no misfit."""
    share: float
    """Of the excess of all runs."""
    steps: float = np.inf
    """RMS misfit above the noise of its mean readings, in steps of the sensor (or, where that is finer
    than its noise, in standard deviations of a reading's)."""


@dataclass(frozen=True, repr=False)
class MisfitMap:
    """All that was located, most significant first."""

    windows: tuple[Located, ...]
    p_value: float
    """Of the most significant window, over all windows of all runs."""
    excess: float
    """Sum of squared standardised errors beyond what is expected."""
    traces: tuple[Trace, ...]
    """Residuals of the fit that was judged, run by run."""

    @property
    def significant(self) -> bool:
        """Whether chance hardly leaves as much."""
        return self.p_value < SIGNIFICANT

    @property
    def steps(self) -> float:
        """Size of the largest misfit of any window, in steps of the sensor; 0 where none is located."""
        return max((one.steps for one in self.windows), default=0.0)

    def __repr__(self) -> str:
        found = f"{len(self.windows)} windows" if self.windows else "nothing"
        return f"MisfitMap({found} located, p = {self.p_value:.2g})"

    def _repr_html_(self) -> str:
        rows = [
            (
                one.run,
                f"{one.start:.4g} to {one.end:.4g}",
                one.where,
                f"{one.rms:.3g} {one.unit}",
                f"{one.p_value:.2g}",
                f"{one.share:.0%}",
            )
            for one in self.windows
        ]
        header = ("run", "time [s]", "where", "RMS misfit", "p", "share of the excess")
        table = html_table(header, rows) if rows else ""
        return f"<p><b>Misfit map</b>: {escape(repr(self))}</p>{table}"


def without_misfit(search: Search, fitted: Fitted) -> Fitted:
    """The same model fitted anew as if readings had nothing but noise, and a tolerated misfit."""
    lasts: Mapping[str, float] = TYPICAL_MISFIT_TIME  # type: ignore[assignment]
    # What is tolerated is in the model already.
    values = {
        f"{regime}.{key}": value
        for regime, level in search.noise.items()
        for key, value in zip(
            NoiseParameters._fields, (level, 1e-3 * level, lasts[regime]), strict=True
        )
    }
    (found,) = search.patient.fit([search.with_shared(fitted.start, values)], list(values))
    return found


def locate(search: Search, fitted: Fitted, *, replicates: int = 400) -> MisfitMap:
    """Windows of all lengths, in every run, against `replicates` that the model itself would give."""
    nested, judged = search.nested, without_misfit(search, fitted)
    lines = [_settled(line) for line in traces(nested, judged)]
    order = np.concatenate([line.place for line in lines])
    names = np.array(nested.shared_names())
    free = ~np.isin(names, noise_names(nested))
    free = np.concatenate([free, np.ones(judged.used - free.size, bool)])
    information = np.asarray(judged.look.information)[: judged.used, : judged.used]
    found = scan(
        judged.errors[order],
        judged.jacobian[order][:, free],
        information[np.ix_(free, free)],
        [line.time.size for line in lines],
        replicated_errors(nested, judged, replicates, search.seed)[order],
    )
    chosen = _apart(found)
    every = float(np.sum(found.errors**2 - found.expected))
    whole = max(every, sum(found.excess(index).sum() for index in chosen), 1e-12)
    lasting = [
        np.ravel(lasting_variance(one, search.noise[regime]))
        for one, regime in zip(judged.data.lanes, nested.layout.regimes, strict=True)
    ]
    error = np.sqrt(error_of_reading(search) ** 2 + np.concatenate(lasting))
    windows = tuple(_told(nested, lines, found, index, whole, error) for index in chosen)
    return MisfitMap(windows, float(found.p_value.min()), every, tuple(lines))


class Scan(NamedTuple):
    """Every window, judged."""

    start: Int[np.ndarray, " window"]
    """First error of the window, all runs one after the other."""
    end: Int[np.ndarray, " window"]
    """Last error, plus one."""
    run: Int[np.ndarray, " window"]
    score: Float[np.ndarray, " window"]
    """z |z| / 2, with z the more extreme of two normal scores: how large errors are, and how lasting."""
    p_value: Float[np.ndarray, " window"]
    """Probability that without misfit any window scores as high."""
    lasting: Bool[np.ndarray, " window"]
    """Whether errors of one sign say more against the window than large ones."""
    errors: Float[np.ndarray, " error"]
    """What parameters cannot absorb of each."""
    expected: Float[np.ndarray, " error"]
    """Mean square of that without misfit."""

    def excess(self, index: int) -> Float[np.ndarray, " error"]:
        """Squares of a window's errors beyond what is expected, of lasting ones those of their mean m.

        e^2 - (e - m)^2 is what m explains of each.
        """
        inside = slice(int(self.start[index]), int(self.end[index]))
        e, expected = self.errors[inside], self.expected[inside]
        if not self.lasting[index]:
            return e**2 - expected
        return 2.0 * e * e.mean() - e.mean() ** 2 - expected / e.size


def scan(
    errors: Float[np.ndarray, " error"],
    slopes: Float[np.ndarray, "error n"],
    information: Float[np.ndarray, "n n"],
    sizes: Sequence[int],
    replicates: Float[np.ndarray, "error replicate"],
) -> Scan:
    """Judge windows of all lengths in runs of these sizes.

    Standardised errors e keep the part that parameters cannot absorb: e - S (S'S + P)^-1 S'e, with
    slopes S and S'S + P the information. Each window's sum of squares, which tells large errors, and
    its sum, which tells small ones that last, are compared with those of `replicates`, errors without
    misfit; its p-value is the probability that any window of any run is as extreme in either.
    Source: Westfall and Young, Resampling-Based Multiple Testing (1993).
    """
    precision = FactoredPrecision(information)

    def left(values: np.ndarray) -> np.ndarray:
        return values - slopes @ precision.solve(slopes.T @ values)

    null, seen = left(replicates), left(errors)
    start, end, run = _windows(sizes)

    def sums(values: np.ndarray) -> np.ndarray:
        total = np.cumsum(np.vstack([np.zeros((1, values.shape[1])), values]), axis=0)
        return total[end] - total[start]

    squares = sums(null**2)
    law = squares.mean(axis=1, keepdims=True), squares.std(axis=1, keepdims=True) + 1e-12
    spread = sums(null).std(axis=1, keepdims=True) + 1e-12

    def judged(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        large, lasting = _normal_score(sums(values**2), *law), np.abs(sums(values)) / spread
        z = np.maximum(large, lasting)
        return 0.5 * z * np.abs(z), lasting > large

    score, lasting = (one[:, 0] for one in judged(seen[:, None]))
    p_value = of_largest(score, judged(null)[0].max(axis=0))
    return Scan(start, end, run, score, p_value, lasting, seen, np.mean(null**2, axis=1))


def _normal_score(total: np.ndarray, mean: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    """Standard normal score of a sum of squares of this mean and standard deviation.

    The cube root of a gamma variable is nearly normal. Source: Wilson and Hilferty, PNAS 17 (1931).
    """
    ninth = (deviation / mean) ** 2 / 9.0
    return (np.cbrt(total / mean) - (1.0 - ninth)) / np.sqrt(ninth)


def of_largest(
    score: Float[np.ndarray, " window"],
    extreme: Float[np.ndarray, " replicate"],
    counted: int = 10,
) -> Float[np.ndarray, " window"]:
    """Probability that the largest score without misfit is as high, from that of many replicates.

    Their share, and where fewer than `counted` are as high, the tail of the Gumbel distribution with
    their mean and variance, joined to it there. Source: Abrams, Kleinman and Kulldorff, International
    Journal of Health Geographics 9:61 (2010).
    """
    share = (1 + np.sum(extreme[None, :] >= score[:, None], axis=1)) / (extreme.size + 1)
    law = gumbel_r(*_by_moments(extreme))
    joint = np.sort(extreme)[-counted]
    level = counted / (extreme.size + 1)
    tail = level * np.exp(law.logsf(score) - law.logsf(joint))
    return np.where(score > joint, np.maximum(tail, LEAST_P), share)


def _by_moments(values: np.ndarray) -> tuple[float, float]:
    """Location and scale of the Gumbel distribution with these values' mean and variance."""
    scale = float(np.std(values)) * np.sqrt(6.0) / np.pi
    return float(np.mean(values)) - np.euler_gamma * scale, scale


def _told(
    nested: Nested,
    lines: Sequence[Trace],
    found: Scan,
    index: int,
    whole: float,
    error: Float[np.ndarray, " error"],
) -> Located:
    line = lines[found.run[index]]
    run = next(run for run in nested.problem.runs if run.name == line.run)
    step = max(run.output_sensor.resolution, noise_of_reading(run))
    offset = sum(one.time.size for one in lines[: found.run[index]])
    inside = slice(int(found.start[index]) - offset, int(found.end[index]) - offset)
    above = float(np.mean(line.residual[inside] ** 2 - error[line.place[inside]] ** 2))
    own = np.zeros(line.time.size)
    own[inside] = found.excess(index)
    return Located(
        run=line.run,
        start=float(line.time[inside][0]),
        end=float(line.time[inside][-1]),
        where=where(line, own, inside),
        rms=float(np.sqrt(np.mean(line.residual[inside] ** 2))),
        unit=line.unit,
        p_value=float(found.p_value[index]),
        share=float(max(own.sum(), 0.0) / whole),
        steps=float(np.sqrt(max(above, 0.0))) / step,
    )


def _settled(line: Trace) -> Trace:
    if "T" not in line.signals:
        return line
    return line.only(is_settled(line.time, line.signals["load"], line.signals["T"]))


def _windows(
    sizes: Sequence[int], shortest: int = 8
) -> tuple[Int[np.ndarray, " w"], Int[np.ndarray, " w"], Int[np.ndarray, " w"]]:
    """First and last-plus-one error and run of every window: halves, quarters, ... each by half over."""
    starts, ends, owner, offset = [], [], [], 0
    for run, size in enumerate(sizes):
        length = size
        while length >= min(shortest, size) and length > 0:
            for start in range(0, size - length + 1, max(length // 2, 1)):
                starts.append(offset + start)
                ends.append(offset + start + length)
                owner.append(run)
            length //= 2
        offset += size
    return np.array(starts), np.array(ends), np.array(owner)


def _apart(found: Scan, most: int = 12) -> list[int]:
    """Significant windows that do not overlap, highest score first."""
    chosen: list[int] = []
    for index in np.argsort(-found.score):
        if found.p_value[index] >= SIGNIFICANT or len(chosen) == most:
            break
        begin, end = found.start[index], found.end[index]
        if all(end <= found.start[i] or begin >= found.end[i] for i in chosen):
            chosen.append(int(index))
    return chosen


def replicated_errors(
    nested: Nested, fitted: Fitted, count: int, seed: int, fine: float = 3.0
) -> Float[np.ndarray, "error replicate"]:
    """Standardised errors of data sets that the model itself would give, in the order of `fitted.errors`.

    A sensor that rounds by more than its noise biases the readings of a rotor at rest, the mean of many
    as much as each: by how much depends on where between two steps it lies, which no model tells so well.

    Readings are rounded as the sensor rounds, where noise is below `fine` of its steps; where between
    two steps each run lies is drawn.
    """
    rng = np.random.default_rng(seed)
    values = values_at(jnp.asarray(fitted.point), fitted.choice, nested.layout, fitted.data)
    places = rng.uniform(0.0, 1.0, (len(nested.problem.runs), count))
    parts = []
    for lanes, regime, owners, residual in zip(
        fitted.data.lanes,
        nested.layout.regimes,
        nested.problem.lane_runs,
        fitted.seen.residuals,
        strict=True,
    ):
        noise, modelled = float(values[f"{regime}.noise"]), lanes.reading - np.asarray(residual)
        for lane, owner in enumerate(owners):
            normal, weight = rng.standard_normal((modelled.shape[1], count)), lanes.weight[lane]
            quantum, coarse = float(lanes.quantum[lane]), np.asarray(lanes.coarse[lane])[:, None]
            readings = np.maximum(np.asarray(weight), 1.0)[:, None]
            if 0.0 < noise < fine * quantum:
                spread = noise / quantum
                place = np.asarray(modelled[lane])[:, None] / quantum + places[owner]
                error = rounded_errors(place, normal, readings, spread)
                normal = error / np.sqrt(spread**2 / readings + coarse)
            parts.append(normal)
    return np.concatenate(parts)


def rounded_errors(
    place: Float[np.ndarray, "interval replicate"],
    normal: Float[np.ndarray, "interval replicate"],
    readings: Float[np.ndarray, "interval 1"],
    spread: float,
) -> Float[np.ndarray, "interval replicate"]:
    """Mean of so many readings with noise of this spread, rounded to integers, less the place measured.

    A single one is round(y + s z) - y of place y. Means have its bias, as far as the place stays the same
    while they are taken, and what is left of its variance.
    """
    single = np.round(place + spread * normal) - place
    bias, deviation = (np.interp(place % 1.0, *table) for table in _tables(spread))
    moved = np.abs(np.gradient(place, axis=0)) if len(place) > 1 else np.zeros_like(place)
    mean = np.sinc(moved) * bias + deviation * normal / np.sqrt(readings)
    return np.where(readings > 1.0, mean, single)


def _tables(spread: float, places: int = 64) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Bias and standard deviation of a rounded reading, each with the places they are of."""
    place = np.linspace(0.0, 1.0, places + 1)
    reach = int(np.ceil(6.0 * spread)) + 2
    told = np.arange(-reach, reach + 2)
    edges = (np.append(told - 0.5, told[-1] + 0.5) - place[:, None]) / spread
    chance = np.diff(norm.cdf(edges), axis=1)
    mean = chance @ told
    variance = chance @ told**2 - mean**2
    return (place, mean - place), (place, np.sqrt(np.maximum(variance, 0.0)))
