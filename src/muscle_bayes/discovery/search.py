"""One step of discovery: candidates from every start fitted together, and the model without them too."""

from collections.abc import Mapping, Sequence

import numpy as np

from muscle_bayes.discovery.anneal import annealed, as_noise
from muscle_bayes.discovery.candidates import Candidate, candidates, promising
from muscle_bayes.discovery.fit import Search
from muscle_bayes.discovery.fitted import Fitted, Start, noise_names
from muscle_bayes.inference.search.other_basins import alternatives


def scored(
    search: Search, base: Fitted, names: Sequence[str], seed: int
) -> dict[str, list[Candidate]]:
    """Candidates beside `base`; where its misfit is large, as if that were white noise."""
    if search.is_gross(base):
        start = as_noise(search, base.start, base.seen.residuals)
        (base,) = search.fit([start], held=noise_names(search.nested), steps=15)
    return candidates(search, base, names, seed)


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
        search.report(f"{name}, from new draws", 0, 1)
        _keep(fits, _from_new_draws(search, base, fits[name]))
    # The model without the candidate, from where the likeliest led: one that stays at a poor local
    # maximum would make all of them look needed.
    starts = [_without(base, fits[name]) for name in _likeliest(fits, 3)]
    return max([base, *search.fit(starts)], key=evidence), fits


def _without(base: Fitted, fitted: Fitted) -> Start:
    """A start of the base's model at a candidate's point."""
    room = np.zeros(base.point.size - base.used)
    return Start(base.effects, np.concatenate([fitted.point[: base.used], room]), fitted.data)


def from_starts(search: Search, screened: Mapping[str, Sequence[Candidate]]) -> dict[str, Fitted]:
    """All starts of all candidates as one batch: annealed, then each one's best two to the end.

    With them goes what promises most as it is: while all misfit counts as white noise, segments of a run
    that begin anew may fit better without the effect.
    """
    chosen = [one.start for some in screened.values() for one in promising(some)]
    effects = [start.effects[-1] for start in chosen]
    search.report("candidates", 0, len(screened))
    finals = _best_two(annealed(search, chosen, effects))
    finals += [some[0].start for some in screened.values() if some and some[0].gain > 3.0]
    fits: dict[str, Fitted] = {}
    search.report("candidates", len(screened) // 2, len(screened))
    # With lasting noise a point begins far above where it soon is: none is given up before that.
    begun = [one.start for one in search.fit(finals, steps=8)]
    _keep(fits, search.fit(begun, behind=200.0))
    best = max(fits.values(), key=evidence, default=None)
    if best is not None and search.is_gross(best) and search.is_lost(best):
        search.report("candidates, on ever longer parts of the runs", 0, 1)
        _keep(fits, _along_the_runs(search, chosen))
    search.report("candidates", len(screened), len(screened))
    return fits


def _along_the_runs(
    search: Search,
    starts: Sequence[Start],
    shares: tuple[float, ...] = (0.15, 0.3, 0.5, 0.7, 1.0, 1.0),
    steps: int = 8,
    most: int = 6,
) -> list[Fitted]:
    """All effects fitted to ever more of the runs, from their first part on; the best `most` to the end.

    Where a rotor runs away, or a state is remembered, a descent over whole runs fails far from the truth;
    what explains the first part leads on to the next.
    """
    effects = [start.effects[-1] for start in starts]
    rounds = [(share, steps) for share in shares]
    return search.fit(annealed(search, starts, effects, rounds, most=1)[:most])


def evidence(one: Fitted) -> float:
    """By which models are ordered."""
    return one.log_evidence


def _best_two(starts: Sequence[Start]) -> list[Start]:
    """The first two starts of every effect."""
    best: dict[str, list[Start]] = {}
    for start in starts:
        best.setdefault(start.effects[-1], []).append(start)
    return [start for some in best.values() for start in some[:2]]


def _keep(fits: dict[str, Fitted], found: Sequence[Fitted]) -> None:
    """The likelier of each candidate's fits; none that cannot be evaluated."""
    for one in found:
        known = fits.get(one.effects[-1])
        if np.isfinite(evidence(one)) and (known is None or evidence(one) > evidence(known)):
            fits[one.effects[-1]] = one


def _likeliest(fits: Mapping[str, Fitted], most: int, behind: float = 100.0) -> list[str]:
    """Names, likeliest first, none too far behind."""
    order = sorted(fits, key=lambda name: -evidence(fits[name]))[:most]
    return [n for n in order if evidence(fits[n]) > evidence(fits[order[0]]) - behind]


def _from_new_draws(search: Search, base: Fitted, fitted: Fitted) -> list[Fitted]:
    """A candidate from new draws of its effect beside its own other parameters.

    Beside those of `base`, which knows nothing of the effect, draws may lead to poor local maxima.
    """
    (there,) = search.fit([_without(base, fitted)], steps=0)
    if not np.isfinite(there.potential):
        return []
    name = fitted.effects[-1]
    starts = promising(scored(search, there, [name], search.seed + 1000)[name])
    return search.fit(annealed(search, [one.start for one in starts], [name] * len(starts))[:2])


def _other_basins(search: Search, fits: Sequence[Fitted], seen: float = 0.3) -> list[Fitted]:
    """Models with springs opening at other forces and runs begun otherwise: no descent goes there.

    Only where some reading changes by `seen` of its noise.
    """
    nested, rows, every = search.nested, list[Start](), [one.start for one in fits]
    plain = [name.partition("[")[0] for name in nested.shared_names()]
    for start in every:
        own = start.point[: nested.shared]
        for entry, value, _ in alternatives(own, plain, nested.layout, nested.data):
            point = start.point.copy()
            point[entry] = value
            rows.append(start._replace(point=point))
    if not rows:
        return []
    search.report("other local maxima", 0, len(rows))
    here = dict(zip((s.effects for s in every), search.explained(every), strict=True))
    kept = []
    for row, there in zip(rows, search.explained(rows), strict=True):
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
    return search.fit(_best_two(annealed(search, kept, groups, [(1.0, 6)])))


def with_own_motion(
    search: Search, fits: Mapping[str, Fitted], *, near: float = 30.0, most: int = 4
) -> dict[str, Fitted]:
    """The likeliest candidates, each settled with the motion of its own point."""
    order = _likeliest(fits, most, near)
    found = {}
    for done, name in enumerate(order):
        search.tick()
        search.report("likeliest candidates, refined", done, len(order))
        found[name] = search.settled(fits[name])
    return found
