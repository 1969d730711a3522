"""Metropolis moves of the springs' minimum forces, whose posterior ends in walls."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.blocks import WALLED, blocks
from muscle_bayes.inference.problem import Layout

SWEEPS = 6
"""Proposals per walled entry and iteration, every other one sheared."""
SPRINGS = dict(zip(WALLED, ("modulus", "stiffness_hyst"), strict=True))
"""Force per strain of the spring that each minimum force belongs to."""


class WalledState(NamedTuple):
    """What the moves change."""

    z: Float[Array, " smooth"]
    """Whitened smooth entries."""
    vector: Float[Array, " n"]
    """The whole; where it moves, its smooth entries stay those of the start and z counts."""
    energy: Float[Array, ""]


def _place(layout: Layout, name: str) -> int:
    """Index of a scalar site in the vector."""
    sizes = [int(np.prod(shape)) for _, shape in layout.shapes]
    return int(np.cumsum([0, *sizes])[[known for known, _ in layout.shapes].index(name)])


def move_walled(
    key: Array,
    state: WalledState,
    energy_at: Callable[[Array, Array], Array],
    factor: Float[Array, "smooth smooth"],
    stride: Float[Array, " walled"],
    layout: Layout,
) -> WalledState:
    """SWEEPS proposals for each walled entry; their density needs no gradient.

    A plain proposal moves a minimum force F alone: where its spring is open, taut_strain holds the
    muscle's length. A sheared one also moves taut_strain by (F - F')/stiffness, so that C stays: that
    holds the length where the spring is shut. A shear keeps volume, so both are symmetric.
    """
    smooth, walled, _ = blocks(layout)
    inside = {int(entry): index for index, entry in enumerate(smooth)}
    taut = inside[_place(layout, "taut_strain")]
    stiffness = [_place(layout, SPRINGS[name]) for name, _ in layout.shapes if name in WALLED]
    along_taut = jax.scipy.linalg.solve_triangular(factor, jnp.eye(len(smooth))[taut], lower=True)
    key_step, key_accept, key_reach = jax.random.split(key, 3)
    count = SWEEPS * walled.size
    steps = jax.random.normal(key_step, (count,))
    # Long and short proposals: a wall near or far from here is reached by either.
    steps = steps * 10.0 ** -jax.random.uniform(key_reach, (count,))
    chances = jnp.log(jax.random.uniform(key_accept, (count,)))
    turns = jnp.arange(count)

    def propose(state: WalledState, now: tuple[Array, ...]) -> tuple[WalledState, None]:
        turn, step, chance, log_stiffness = now
        which = turn % walled.size
        entry = jnp.asarray(walled)[which]
        before = state.vector[entry]
        after = before + stride[which] * step
        sheared = (turn // walled.size) % 2
        shift = sheared * (jnp.exp(before) - jnp.exp(after)) / jnp.exp(log_stiffness)
        z = state.z + shift * along_taut
        vector = state.vector.at[entry].set(after)
        energy = energy_at(z, vector)
        trial = WalledState(z, vector, energy)
        accept = chance < state.energy - energy
        return jax.tree.map(lambda a, b: jnp.where(accept, a, b), trial, state), None

    # No proposal changes the springs' stiffnesses.
    held = state.vector[jnp.asarray(stiffness)][turns % walled.size]
    return jax.lax.scan(propose, state, (turns, steps, chances, held))[0]
