"""One step of discovery: candidates from every start fitted together, and the model without them too."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from time import monotonic

import numpy as np

from muscle_bayes.discovery.candidates import Candidate, candidates, promising
from muscle_bayes.discovery.fit import (
    Fitted,
    Report,
    Start,
    annealed,
    explained_all,
    fit_all,
    in_slow_motion,
    misfit,
    noise_names,
    settled,
    tempered,
)
from muscle_bayes.discovery.nominal import noise_by_regime
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.other_basins import alternatives


class OutOfTime(Exception):
    """The budget is spent."""


@dataclass
class Search:
    """What every step needs."""

    nested: Nested
    seed: int
    held: tuple[str, ...] = ()
    """Names of runs that are held out."""
    workers: int = 1
    """Rows that are evaluated side by side; results do not depend on it."""
    report: Report = lambda stage, done, total: None
    deadline: float = np.inf
    """By which an answer is wanted, as `time.monotonic` counts."""
    noise: dict[str, float] = field(init=False)

    def __post_init__(self) -> None:
        self.noise = noise_by_regime(self.nested.problem)

    def tick(self) -> None:
        """Raise where time is up."""
        if monotonic() > self.deadline:
            raise OutOfTime

    def fit(self, starts: Sequence[Start], **options) -> list[Fitted]:
        """`fit_all` in this search."""
        return fit_all(self.nested, starts, workers=self.workers, tick=self.tick, **options)

    def anneal(self, starts: Sequence[Start], groups: Sequence[str], **options) -> list[Start]:
        """`annealed` in this search."""
        return annealed(
            self.nested, starts, self.noise, groups, workers=self.workers, tick=self.tick, **options
        )

    def is_gross(self, fitted: Fitted, times: float = 3.0) -> bool:
        """Whether the misfit of some regime is so many times the noise of a reading."""
        levels = misfit(self.nested, fitted.look.residuals, fitted.data)
        return any(rms > times * self.noise[regime] for regime, (rms, _) in levels.items())

    def scored(self, base: Fitted, names: Sequence[str], seed: int) -> dict[str, list[Candidate]]:
        """Candidates beside `base`; where its misfit is large, as if that were white noise."""
        if self.is_gross(base):
            start = tempered(self.nested, base.start, base.look.residuals)
            (base,) = self.fit([start], held=noise_names(self.nested), steps=15)
        return candidates(self.nested, base, names, seed, workers=self.workers)


def fit_candidates(
    search: Search, base: Fitted, screened: Mapping[str, Sequence[Candidate]]
) -> tuple[Fitted, dict[str, Fitted]]:
    """The best fit of every candidate in slow motion alone, and the model without them, as good.

    What inertia adds to slow motion belongs to one model: candidates are searched without it. Those whose
    starts end far behind stay where they are.
    """
    fits = from_starts(search, screened)
    likely = _likeliest(fits, 3)
    _keep(fits, _other_basins(search, [fits[name] for name in likely]))
    for name in likely[:2]:
        search.report(f"{name} again", 0, 1)
        again = _from_new_draws(search, base, fits[name])
        _keep(fits, again)
    # The model without the candidate, from where the likeliest led: one that stays at a poor local
    # maximum would make all of them look needed.
    room = base.point.size - base.used
    starts = [
        Start(base.effects, np.concatenate([f.point[: base.used], np.zeros(room)]), f.data)
        for f in (fits[name] for name in _likeliest(fits, 3))
    ]
    return max([base, *search.fit(starts)], key=_evidence), fits


def from_starts(search: Search, screened: Mapping[str, Sequence[Candidate]]) -> dict[str, Fitted]:
    """All starts of all candidates as one batch: annealed, then each one's best two to the end."""
    chosen = [one for some in screened.values() for one in promising(some)]
    search.report("candidates", 0, len(screened))
    ends = search.anneal([one.start for one in chosen], [one.effect for one in chosen])
    best: dict[str, list[Start]] = {}
    for start in ends:
        best.setdefault(start.effects[-1], []).append(start)
    finals = [start for some in best.values() for start in some[:2]]
    fits: dict[str, Fitted] = {}
    search.report("candidates", len(screened) // 2, len(screened))
    # With lasting noise a point begins far above where it soon is: none is given up before that.
    begun = [one.start for one in search.fit(finals, steps=8)]
    _keep(fits, search.fit(begun, behind=200.0))
    if fits and search.is_gross(max(fits.values(), key=_evidence)):
        search.report("candidates, along the runs", 0, 1)
        _keep(fits, _along_the_runs(search, [one.start for one in chosen]))
    search.report("candidates", len(screened), len(screened))
    return fits


def _along_the_runs(
    search: Search,
    starts: Sequence[Start],
    shares: tuple[float, ...] = (0.15, 0.3, 0.5, 0.7, 1.0, 1.0),
    steps: int = 8,
    behind: float = 100.0,
    most: int = 6,
) -> list[Fitted]:
    """All effects fitted to ever more of the runs, from their first part on; the best `most` to the end.

    Where a rotor runs away, or a state is remembered, a descent over whole runs fails far from the truth;
    what explains the first part leads on to the next.
    """
    effects = [start.effects[-1] for start in starts]
    rounds = [(share, steps) for share in shares]
    return search.fit(search.anneal(starts, effects, rounds=rounds, behind=behind)[:most])


def _evidence(one: Fitted) -> float:
    return one.log_evidence


def _keep(fits: dict[str, Fitted], found: Sequence[Fitted]) -> None:
    """The likelier of each candidate's fits; none that cannot be evaluated."""
    for one in found:
        name = one.effects[-1]
        if np.isfinite(one.log_evidence) and (
            name not in fits or one.log_evidence > fits[name].log_evidence
        ):
            fits[name] = one


def _likeliest(fits: Mapping[str, Fitted], most: int, behind: float = 100.0) -> list[str]:
    """Names, likeliest first, none too far behind."""
    order = sorted(fits, key=lambda name: -fits[name].log_evidence)[:most]
    return [n for n in order if fits[n].log_evidence > fits[order[0]].log_evidence - behind]


def _from_new_draws(search: Search, base: Fitted, fitted: Fitted) -> list[Fitted]:
    """A candidate from new draws of its effect beside its own other parameters.

    Beside those of `base`, which knows nothing of the effect, draws may lead to poor local maxima.
    """
    room = np.zeros(base.point.size - base.used)
    point = np.concatenate([fitted.point[: base.used], room])
    (there,) = search.fit([Start(base.effects, point, fitted.data)], steps=0)
    if not np.isfinite(there.potential):
        return []
    name = fitted.effects[-1]
    starts = promising(search.scored(there, [name], search.seed + 1000)[name])
    return search.fit(search.anneal([one.start for one in starts], [name] * len(starts))[:2])


def _other_basins(search: Search, fits: Sequence[Fitted], seen: float = 0.3) -> list[Fitted]:
    """Models with springs opening at other forces and runs begun otherwise: no descent goes there.

    Only where some reading changes by `seen` of its noise.
    """
    nested, rows = search.nested, list[Start]()
    for one in fits:
        names = np.array(nested.shared_names())
        for name, value in _moves(nested, one):
            point = one.point.copy()
            point[np.flatnonzero(names == name)[0]] = value
            rows.append(one.start._replace(point=point))
    if not rows:
        return []
    search.report("other basins", 0, len(rows))
    every = [one.start for one in fits]
    here = dict(zip((s.effects for s in every), explained_all(nested, every), strict=True))
    kept = []
    for row, there in zip(rows, explained_all(nested, rows, search.workers), strict=True):
        away = max(
            float(np.abs((a - b)[np.asarray(lanes.weight) > 0]).max() / search.noise[regime])
            for a, b, lanes, regime in zip(
                there.residuals,
                here[row.effects].residuals,
                nested.data.lanes,
                nested.layout.regimes,
                strict=True,
            )
        )
        if np.isfinite(away) and away > seen:
            kept.append(row)
    groups = [row.effects[-1] for row in kept]
    begun = search.anneal(kept, groups, rounds=[(1.0, 6)], behind=100.0)
    best: dict[str, list[Start]] = {}
    for start in begun:
        best.setdefault(start.effects[-1], []).append(start)
    return search.fit([start for some in best.values() for start in some[:2]])


def _moves(nested: Nested, fitted: Fitted) -> list[tuple[str, float]]:
    """Shared entries by name, and other values of them, that no descent finds by itself."""
    names = nested.shared_names()
    plain = [name.partition("[")[0] for name in names]
    return [
        (names[entry], value)
        for entry, value, _ in alternatives(
            fitted.point[: nested.shared], plain, nested.layout, nested.data
        )
    ]


def with_own_motion(
    search: Search, fits: Mapping[str, Fitted], *, near: float = 30.0, most: int = 4
) -> dict[str, Fitted]:
    """The likeliest candidates, each settled with the motion of its own point."""
    order = _likeliest(fits, most, near)
    found = {}
    for done, name in enumerate(order):
        search.tick()
        search.report("own motion", done, len(order))
        found[name] = settled(search.nested, fits[name], workers=search.workers)
    return found


def slow(search: Search, base: Fitted) -> Fitted:
    """The base in slow motion alone."""
    (found,) = search.fit([in_slow_motion(base)])
    return found
