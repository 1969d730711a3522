"""A candidate where springs open at other forces and runs begin otherwise: no descent goes there."""

from collections.abc import Sequence
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from muscle_bayes.discovery.gross import as_lasting, as_white, noise_names
from muscle_bayes.discovery.old_basins import (
    FIRST_FORCE,
    SEEN,
    SEEN_LATER,
    WALLED,
    expected_noise,
    first_hyst_levels,
    force_levels,
    moved_entries,
)
from muscle_bayes.inference.records.tensions import log_tensions
from muscle_bayes.inference.search.descent import FIRST_DAMPING, Fitted, descend, go_on
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.nested_programs import explained_at

BELOW, FORCE_STEP = 0.25, 0.05
"""How far below the least tension seen WALLED[0]'s minimum force is tried, and in what steps up to the
greatest, in logarithms, besides at quantiles of its prior. Beside an effect that acts while parts go taut
it matters by hundredths."""
HELD_STEPS, FREE_STEPS = 6, 12
"""Steps with what was moved held, and with all free."""
EARLY_STEPS, FALLEN_BEHIND = 3, 1_000.0
"""Steps with what was moved held before a point is given up that is this far behind [nat]."""
HOPELESS = 200.0
"""The same after all steps with what was moved held [nat]."""
BETTER = 1.0
"""Least decrease of the potential for a point that is fitted in full [nat]."""


def with_best_basin(
    nested: Nested, fitted: Fitted, others: Sequence[Float[np.ndarray, " n"]] = ()
) -> Fitted:
    """`fitted`, or what is likelier with a spring opening at another force or a run begun otherwise.

    WALLED[0]'s force is moved from `others` too: points with the effect in other strengths, for one that
    acts while it opens finds no place alone. All misfit is taken for white noise until then:
    a lasting discrepancy would explain what a spring on the wrong side does.
    """
    layout, data, names = nested.layout, nested.data, nested.shared_names()
    forces = force_levels(layout, data)
    if not forces:
        return fitted
    expected = expected_noise(layout, data)

    def readings(point: np.ndarray) -> np.ndarray:
        found = explained_at(jnp.asarray(point), fitted.choice, layout, data)
        groups = zip(found.residuals, data.lanes, expected, strict=True)
        parts = [
            (np.asarray(one) / noise)[np.asarray(lanes.weight) > 0] for one, lanes, noise in groups
        ]
        return np.concatenate(parts)

    best, seen, noise = fitted, as_white(nested, fitted), noise_names(nested)
    taut = _taut_levels(nested)
    forces[WALLED[0]] = np.concatenate([taut, forces[WALLED[0]]])
    levels = {names.index(name): values for name, values in forces.items()}
    begun = first_hyst_levels(seen.point, nested.entries_named(FIRST_FORCE))
    tried = [
        *((point, forces) for point in moved_entries(seen.point, levels, readings, SEEN)),
        *((point, ()) for point in moved_entries(seen.point, begun, readings, SEEN_LATER)),
    ]
    for other in others:
        point = np.concatenate([seen.point[: nested.shared], other[nested.shared :]])
        elsewhere = moved_entries(point, {names.index(WALLED[0]): taut}, readings, SEEN)
        tried += [(one, forces) for one in elsewhere]
    for moved, held in tried:
        room = descend(nested, fitted.effects, moved, EARLY_STEPS, [*noise, *held])
        if not room.potential <= seen.potential + FALLEN_BEHIND:
            continue
        room = go_on(nested, room, HELD_STEPS - EARLY_STEPS, [*noise, *held])
        if not room.potential <= seen.potential + HOPELESS:
            continue
        # How far steps went with entries held says nothing of steps without.
        free = go_on(nested, replace(room, damping=FIRST_DAMPING), FREE_STEPS, noise)
        if free.potential < seen.potential - BETTER:
            best = max(best, as_lasting(nested, free), key=lambda one: one.log_evidence)
    return best


def _taut_levels(nested: Nested) -> Float[np.ndarray, " level"]:
    """Logs of WALLED[0]'s minimum force about the tensions that muscles have seen."""
    seen = np.concatenate([np.zeros(0), *map(log_tensions, nested.problem.runs)])
    return np.arange(seen.min() - BELOW, seen.max(), FORCE_STEP) if seen.size else seen
