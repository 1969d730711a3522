"""A candidate where springs open at other forces and runs begin otherwise: no descent goes there."""

import jax.numpy as jnp
import numpy as np

from muscle_bayes.discovery.gross import as_lasting, as_white, noise_names
from muscle_bayes.inference.descent import Fitted, descend, go_on
from muscle_bayes.inference.nested import Nested
from muscle_bayes.inference.nested_programs import explained_at
from muscle_bayes.inference.other_basins import (
    SEEN,
    SEEN_LATER,
    expected_noise,
    first_hyst_levels,
    force_levels,
    moved_entries,
)

HELD_STEPS, FREE_STEPS = 6, 12
"""Steps with what was moved held, and with all free."""
HOPELESS = 50.0
"""A point that is this far behind with what was moved held is given up [nat]."""
BETTER = 1.0
"""Least decrease of the potential for a point that is fitted in full [nat]."""


def with_best_basin(nested: Nested, fitted: Fitted) -> Fitted:
    """`fitted`, or what is likelier with a spring opening at another force or a run begun otherwise.

    All misfit is taken for white noise until then, for a lasting discrepancy would explain what a spring
    on the wrong side does.
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
    levels = {names.index(name): values for name, values in forces.items()}
    begun = first_hyst_levels(seen.point, nested.first_hyst_entries())
    tried = [
        *((point, forces) for point in moved_entries(seen.point, levels, readings, SEEN)),
        *((point, ()) for point in moved_entries(seen.point, begun, readings, SEEN_LATER)),
    ]
    for moved, held in tried:
        room = descend(nested, fitted.effects, moved, HELD_STEPS, [*noise, *held])
        if not room.potential <= seen.potential + HOPELESS:
            continue
        free = go_on(nested, room, FREE_STEPS, noise)
        if free.potential < seen.potential - BETTER:
            best = max(best, as_lasting(nested, free), key=lambda one: one.log_evidence)
    return best
