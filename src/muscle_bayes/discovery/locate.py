"""Where the misfit is: windows of time whose errors exceed what noise and uncertain parameters allow."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import jax
import numpy as np
from jaxtyping import Float

from muscle_bayes.discovery.conditions import Trace, is_settled, traces, where
from muscle_bayes.discovery.fit import Search
from muscle_bayes.discovery.fitted import Fitted, noise_names
from muscle_bayes.discovery.nominal import error_of_reading, noise_of_reading
from muscle_bayes.discovery.scan import Scan, scan
from muscle_bayes.inference.model.likelihood import lasting_variance
from muscle_bayes.inference.model.noise import NoiseParameters
from muscle_bayes.inference.model.problem import TYPICAL_MISFIT_TIME
from muscle_bayes.inference.model.rounding import rounded_errors
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.nested_programs import values_of
from muscle_bayes.markup import html_table

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
    values = values_of(fitted.point, fitted.choice, nested.layout, fitted.data)
    places = rng.uniform(0.0, 1.0, (len(nested.problem.runs), count))
    parts = []
    for lanes, regime, owners, residual in zip(
        fitted.data.lanes,
        nested.layout.regimes,
        nested.problem.lane_runs,
        fitted.seen.residuals,
        strict=True,
    ):
        noise, whole = float(values[f"{regime}.noise"]), jax.tree.map(np.asarray, lanes)
        modelled = whole.reading - np.asarray(residual)
        for lane, owner in enumerate(owners):
            normal = rng.standard_normal((modelled.shape[1], count))
            quantum, coarse = float(whole.quantum[lane]), whole.coarse[lane][:, None]
            readings = np.maximum(whole.weight[lane], 1.0)[:, None]
            if 0.0 < noise < fine * quantum:
                spread = noise / quantum
                place = modelled[lane][:, None] / quantum + places[owner]
                error = rounded_errors(place, normal, readings, spread)
                normal = error / np.sqrt(spread**2 / readings + coarse)
            parts.append(normal)
    return np.concatenate(parts)
