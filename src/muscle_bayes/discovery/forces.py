"""A candidate where springs open at other forces: its descents end on the side where they began."""

import jax.numpy as jnp
import numpy as np

from muscle_bayes.discovery.gross import as_lasting, as_white, noise_names
from muscle_bayes.inference.descent import Fitted, descend
from muscle_bayes.inference.nested import Nested
from muscle_bayes.inference.nested_programs import explained_at
from muscle_bayes.inference.other_forces import expected_noise, force_levels, moved_forces

HELD_STEPS, FREE_STEPS = 6, 12
"""Steps with the minimum forces held, and with them free."""
BETTER = 1.0
"""Least decrease of the potential for a point that is fitted in full [nat]."""


def with_best_forces(nested: Nested, fitted: Fitted) -> Fitted:
    """`fitted`, or what is likelier with a spring opening at another force.

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
    for moved in moved_forces(seen.point, levels, readings):
        room = descend(nested, fitted.effects, moved, HELD_STEPS, [*noise, *forces])
        free = descend(nested, fitted.effects, room.point, FREE_STEPS, noise)
        if free.potential < seen.potential - BETTER:
            best = max(best, as_lasting(nested, free), key=lambda one: one.log_evidence)
    return best
