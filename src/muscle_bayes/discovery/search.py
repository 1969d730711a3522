"""The best fit of every candidate: promising starts, a few steps each, the best to the end."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import jax
import numpy as np

from muscle_bayes.discovery.afresh import started_afresh
from muscle_bayes.discovery.basins import with_best_basin
from muscle_bayes.discovery.gross import as_lasting, as_white, is_gross, noise_names
from muscle_bayes.discovery.screen import Start, redrawn, starts_of
from muscle_bayes.inference.running.side_by_side import side_by_side
from muscle_bayes.inference.search.descent import Fitted, descend, go_on
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.physics.effect import Port
from muscle_bayes.physics.effects import effect_type
from muscle_bayes.physics.effects.empirical import PREFIX

Report = Callable[[str, int, int], None]

STARTS, FUNCTION_STARTS = 5, 2
"""Starts of a candidate that are tried, and of a function: its coefficients act nearly linearly."""
EARLY_STEPS = 3
"""Steps of each before those FALLEN_BEHIND are given up."""
FALLEN_BEHIND = 100.0
"""How far behind another start that is [nat]."""
FIRST_STEPS = 6
"""Steps of the others before the best goes on."""
HOPELESS = 30.0
"""A start that is this far behind another after its first steps is given up [nat]."""
GROSS_STEPS = 12
"""The same where misfit is gross: parameters have far to go."""
FAR = 200.0
"""A candidate that is this far behind another after its first steps stays as it is [nat]."""
REVISITED, FUNCTIONS_REVISITED = 3, 1
"""Candidates that may be started again where they end, and in other basins, and from which the model
without them is searched once more; of functions the likeliest alone."""
OUT_OF_REACH = 100.0
"""Log evidence that a candidate lacks of the best, searched to the end, to be searched no further [nat]."""
MOST_AFRESH = 4
"""Candidates that are fitted in full from draws of the prior."""
AGAIN = 1_000
"""Added to the seed of a candidate's draws each time it is started again."""
IN_VAIN = 2
"""Times in a row without a better end after which it is not started again."""
MOST_AGAIN = 5
"""Times that it is started again at most."""
BETTER = 3.0
"""Rise of log evidence from which on a candidate is started again, and from which on a base is one
beside which candidates are searched anew [nat]."""
STRETCHED: tuple[Port, ...] = ("tension", "offset", "modulus")
"""Ports of effects that can stand in for where MODULUS opens."""
REDRAWN = 3
"""Draws of such an effect beside which MODULUS is made to open elsewhere."""
MOST_BASES = 3
"""Bases beside which candidates are searched at most."""


def first_steps(nested: Nested, base: Fitted, effect: str, starts: Sequence[Start]) -> list[Fitted]:
    """The candidate that adds `effect` to `base` after first steps from its starts; best first.

    Where the misfit of `base` is gross, starts are those beside `as_white`, and noise stays as it is
    there until the best of them is fitted in full.
    """
    effects, gross = (*base.effects, effect), is_gross(nested, base)
    held = noise_names(nested) if gross else []
    steps = GROSS_STEPS if gross else FIRST_STEPS
    begun = [
        descend(nested, effects, one.point, EARLY_STEPS, held) for one in _tried(effect, starts)
    ]
    kept = _within(FALLEN_BEHIND, begun)
    return _within(HOPELESS, [go_on(nested, one, steps - EARLY_STEPS, held) for one in kept])


def _within(lead: float, fits: Sequence[Fitted]) -> list[Fitted]:
    """Those not further behind the best, best first; none that is not finite."""
    finite = [one for one in fits if np.isfinite(one.potential)]
    best = min((one.potential for one in finite), default=0.0)
    near = [one for one in finite if one.potential <= best + lead]
    return sorted(near, key=lambda one: one.potential)


def finished(nested: Nested, base: Fitted, begun: Sequence[Fitted]) -> Fitted:
    """The likeliest of a candidate's two best starts, each at its most probable point."""
    gross = is_gross(nested, base)
    whole = [as_lasting(nested, one) if gross else go_on(nested, one) for one in begun[:2]]
    return max(whole, key=lambda one: one.log_evidence)


def started_again(nested: Nested, base: Fitted, fitted: Fitted, seed: int) -> Fitted:
    """`fitted`, or what is likelier from new draws of its last effect beside its own other parameters.

    Beside those of `base`, which knows nothing of the effect, most draws lead to poor local maxima.
    """
    vain = 0
    for turn in range(1, MOST_AGAIN + 1):
        found = _from_new_draws(nested, base, fitted, seed + AGAIN * turn)
        vain = 0 if found.log_evidence > fitted.log_evidence + BETTER else vain + 1
        fitted = max(fitted, found, key=lambda one: one.log_evidence)
        if vain == IN_VAIN:
            break
    return fitted


def _from_new_draws(nested: Nested, base: Fitted, fitted: Fitted, seed: int) -> Fitted:
    """The same, of one set of draws; `fitted` where none can be simulated."""
    effect, room = fitted.effects[-1], base.point.size - base.used
    shared = np.concatenate([fitted.point[: base.used], np.zeros(room)])
    there = descend(nested, base.effects, shared, 0)
    if not np.isfinite(there.potential):
        return fitted
    begun = first_steps(
        nested, there, effect, starts_of(nested, there, effect, jax.random.key(seed))
    )
    return finished(nested, there, begun) if begun else fitted


def without_last(nested: Nested, fits: Sequence[Fitted], base: Fitted, workers: int = 1) -> Fitted:
    """`base`, or what the likeliest candidates lead to without their last effect if that is likelier.

    Candidates had many starts; a base that stays at a poor local maximum would make all of them look
    needed.
    """
    likely = sorted(fits, key=lambda one: -one.log_evidence)[:REVISITED]
    room = np.zeros(base.point.size - base.used)
    starts = [np.concatenate([one.point[: base.used], room]) for one in likely]

    def led_to(start: np.ndarray) -> Fitted:
        return descend(nested, base.effects, start)

    found = side_by_side(led_to, starts, workers)
    return max([base, *found], key=lambda one: one.log_evidence)


def _tried(effect: str, starts: Sequence[Start]) -> list[Start]:
    """The most promising starts; of a named effect, at least one of every strength."""
    if _is_function(effect):
        return list(starts[:FUNCTION_STARTS])
    chosen = list(starts[: STARTS - 2])
    for strength in {one.strength for one in starts} - {one.strength for one in chosen}:
        chosen.append(next(one for one in starts if one.strength == strength))
    rest = [one for one in starts if all(one is not other for other in chosen)]
    return (chosen + rest)[:STARTS]


def _is_function(effect: str) -> bool:
    return effect.startswith(f"{PREFIX}-")


def screen(
    nested: Nested, base: Fitted, effects: Sequence[str], seed: int, workers: int = 1
) -> dict[str, list[Start]]:
    """Starts of each candidate, most promising first."""
    seen = as_white(nested, base) if is_gross(nested, base) else base

    def starts(numbered: tuple[int, str]) -> list[Start]:
        number, effect = numbered
        return starts_of(nested, seen, effect, jax.random.key(seed + number))

    return dict(zip(effects, side_by_side(starts, enumerate(effects), workers), strict=True))


def fit_candidates(
    nested: Nested,
    base: Fitted,
    screened: Mapping[str, Sequence[Start]],
    seed: int,
    report: Report = lambda name, done, total: None,
    workers: int = 1,
) -> dict[str, Fitted]:
    """The best fit of each candidate that can be simulated.

    `workers` candidates are searched side by side; the result does not depend on their number.
    """

    def first(effect: str) -> list[Fitted]:
        return first_steps(nested, base, effect, screened[effect])

    begun, results = {}, side_by_side(first, screened, workers)
    for done, effect in enumerate(screened):
        report(effect, done, len(screened))
        if steps := next(results):
            begun[effect] = steps
    best = min((steps[0].potential for steps in begun.values()), default=0.0)

    def last(effect: str) -> Fitted:
        steps = begun[effect]
        return finished(nested, base, steps) if steps[0].potential <= best + FAR else steps[0]

    return dict(zip(begun, side_by_side(last, begun, workers), strict=True))


def fit_afresh(
    nested: Nested, base: Fitted, names: Sequence[str], seed: int, workers: int = 1
) -> dict[str, Fitted]:
    """Candidates fitted from draws of the prior (`afresh`): at most MOST_AFRESH, none FAR behind."""

    def first(effect: str) -> list[Fitted]:
        return started_afresh(nested, base, effect, seed)

    results = zip(names, side_by_side(first, names, workers), strict=True)
    begun = {effect: found[0] for effect, found in results if found}
    order = sorted(begun, key=lambda effect: begun[effect].potential)[:MOST_AFRESH]
    near = [one for one in order if begun[one].potential <= begun[order[0]].potential + FAR]

    def last(effect: str) -> Fitted:
        return as_lasting(nested, begun[effect])

    return dict(zip(near, side_by_side(last, near, workers), strict=True))


def searched_further(
    nested: Nested, base: Fitted, found: Mapping[str, Fitted], seed: int, workers: int = 1
) -> dict[str, Fitted]:
    """The candidates found, the likeliest started again and tried in other basins."""

    def further(effect: str) -> Fitted:
        fitted = started_again(nested, base, found[effect], seed)
        others = []
        if effect_type(effect).port in STRETCHED and not _is_function(effect):
            others = redrawn(nested, fitted, jax.random.key(seed), REDRAWN)
        return with_best_basin(nested, fitted, others)

    likely = _revisited(found)
    return {**found, **dict(zip(likely, side_by_side(further, likely, workers), strict=True))}


def _revisited(found: Mapping[str, Fitted]) -> list[str]:
    """Candidates that are searched further, likeliest first."""
    most = FUNCTIONS_REVISITED if all(map(_is_function, found)) else REVISITED
    order = sorted(found, key=lambda name: -found[name].log_evidence)[:most]
    reached = max((one.log_evidence for one in found.values()), default=0.0) - OUT_OF_REACH
    return [effect for effect in order if found[effect].log_evidence >= reached]


class Searched(NamedTuple):
    """Candidates, and the model without them, each at the best point that was found."""

    base: Fitted
    screened: Mapping[str, Sequence[Start]]
    fits: Mapping[str, Fitted]


def search_candidates(
    nested: Nested,
    base: Fitted,
    names: Sequence[str],
    seed: int,
    report: Report = lambda name, done, total: None,
    workers: int = 1,
) -> Searched:
    """Candidates beside `base`, or beside what they led to without themselves where that is likelier.

    A better base means better candidates: they are searched beside it once more, or those that began
    beside the poor one would be held against it.
    """
    fits: dict[str, Fitted] = {}

    def with_these(found: Mapping[str, Fitted], base: Fitted) -> Fitted:
        """The base after `found`, which `fits` keep where they are likelier."""
        for name, one in found.items():
            fits[name] = max(fits.get(name, one), one, key=lambda fitted: fitted.log_evidence)
        return without_last(nested, list(fits.values()), base, workers)

    for turn in range(1, MOST_BASES + 1):
        screened, begun = screen(nested, base, names, seed, workers), base
        found = fit_candidates(nested, base, screened, seed, report, workers)
        base = with_these(found, base)
        if turn == 1:
            base = with_these(fit_afresh(nested, begun, names, seed, workers), base)
        # What takes longest is not done beside a base that another takes the place of.
        if turn == MOST_BASES or base.log_evidence < begun.log_evidence + BETTER:
            found = searched_further(nested, begun, fits, seed, workers)
            base = with_these(found, base)
        if base.log_evidence < begun.log_evidence + BETTER:
            break
    return Searched(base, screened, fits)
