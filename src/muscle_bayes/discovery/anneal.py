"""Annealing: descents in which all misfit is white noise, large first, then as small as it has become."""

from collections.abc import Hashable, Mapping, Sequence

import numpy as np

from muscle_bayes.discovery.fit import Search
from muscle_bayes.discovery.fitted import Start, first_share, noise_names
from muscle_bayes.inference.model.problem import TYPICAL_MISFIT_TIME, Data


def annealed(
    search: Search,
    starts: Sequence[Start],
    groups: Sequence[Hashable],
    rounds: Sequence[tuple[float, int]] = ((1.0, 4), (1.0, 6)),
    behind: float = 0.5,
    most: int = 3,
) -> list[Start]:
    """Starts after descents in which all misfit is white noise, best first.

    Each of the `rounds` takes the first share of every run, and so many steps, with noise set to the
    misfit: large first, so that a lasting discrepancy does not hide what causes it, then smaller. After
    each, the `most` of a group stay whose log misfit is least, if it is not `behind` the best. None that
    cannot be evaluated stays; what is returned has lasting noise.
    """
    held = noise_names(search.nested)
    rows = list(zip(starts, groups, (start.data for start in starts), strict=True))
    for share, count in rounds:
        cut = [start._replace(data=first_share(data, share)) for start, _, data in rows]
        begun = [
            (as_noise(search, start, one.residuals), group, data)
            for start, one, (_, group, data) in zip(cut, search.explained(cut), rows, strict=True)
            if np.isfinite(float(one.potential))
        ]
        ends = search.descended([start for start, _, _ in begun], held, count)
        ended = [
            (log_misfit(search, end.look.seen.residuals, start.data), end, start, group, data)
            for end, (start, group, data) in zip(ends, begun, strict=True)
            if np.isfinite(end.potential)
        ]
        kept: dict[Hashable, list[float]] = {}
        rows = []
        for size, end, start, group, data in sorted(ended, key=lambda one: one[0]):
            sizes = kept.setdefault(group, [])
            if len(sizes) < most and size < min(sizes, default=size) + behind:
                sizes.append(size)
                rows.append((start._replace(point=end.point), group, data))
    whole = [start._replace(data=data) for start, _, data in rows]
    return [
        as_lasting(search, start, one.residuals)
        for start, one in zip(whole, search.explained(whole), strict=True)
    ]


def as_noise(search: Search, start: Start, residuals: Sequence) -> Start:
    """The start with its misfit taken for white noise."""
    values = {}
    for regime, (rms, readings) in search.misfit(residuals, start.data).items():
        values[f"{regime}.noise"] = rms * np.sqrt(readings)
        values[f"{regime}.discrepancy"] = 1e-3 * rms
    return search.with_shared(start, values)


def as_lasting(search: Search, start: Start, residuals: Sequence) -> Start:
    """The start with the noise of a reading, and what is more of its misfit taken for lasting."""
    lasts: Mapping[str, float] = TYPICAL_MISFIT_TIME  # type: ignore[assignment]
    values = {}
    for regime, (rms, _) in search.misfit(residuals, start.data).items():
        noise = search.noise[regime]
        values[f"{regime}.noise"] = noise
        values[f"{regime}.discrepancy"] = max(rms, 0.1 * noise)
        values[f"{regime}.correlation_time"] = lasts[regime]
    return search.with_shared(start, values)


def log_misfit(search: Search, residuals: Sequence, data: Data) -> float:
    """Log RMS residual of a regime in noises of a reading, mean over all intervals."""
    found = search.misfit(residuals, data)
    count = dict.fromkeys(found, 0)
    for regime, lanes in zip(search.nested.layout.regimes, data.lanes, strict=True):
        count[regime] += int((np.asarray(lanes.weight) > 0).sum())
    sizes = [count[key] * np.log(rms / search.noise[key]) for key, (rms, _) in found.items()]
    return float(sum(sizes) / max(sum(count.values()), 1))
