"""Metropolis moves of the springs' minimum forces, whose posterior ends in walls."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import biject_to

from muscle_bayes.inference.blocks import WALLED, blocks
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.program import Program
from muscle_bayes.inference.proposed_move import ProposedMove
from muscle_bayes.physics.springs import tensile_strain

CARRYING = WALLED[0]
"""The minimum force that friction may be carried along with."""
SPRINGS = dict(zip(WALLED, ("modulus", "stiffness_hyst"), strict=True))
"""Force per strain of the spring that each minimum force belongs to."""
BINS = 128
"""Bins of a tabulated conditional density."""
TAILS = 1e-4
"""Prior probability on either side of the table."""
EVEN_SHARE = 0.05
"""Share of a table's probability that is spread evenly, for walls that lie elsewhere."""
TABLED = 0.75
"""Share of proposals that come from the table; the others are local."""
CARRIED = 0.15
"""Share of the proposals of MODULUS's minimum force that carry friction along."""
REACH = 0.5
"""Standard deviation of the logarithm of that force in the longest of these."""


class Table(NamedTuple):
    """Piecewise constant densities of the walled entries, from which proposals are drawn."""

    low: Float[Array, " walled"]
    width: Float[Array, " walled"]
    """Of one bin."""
    log_share: Float[Array, "walled bin"]
    """Log probability of each bin."""

    @classmethod
    def empty(cls, layout: Layout) -> "Table":
        """A table of the layout's shapes that holds nothing."""
        count = blocks(layout).walled.size
        return cls(jnp.zeros(count), jnp.ones(count), jnp.zeros((count, BINS)))

    def draw(self, key: Array, which: Array) -> Float[Array, ""]:
        """A draw of entry `which`."""
        key_bin, key_place = jax.random.split(key)
        chosen = jax.random.categorical(key_bin, self.log_share[which])
        return self.low[which] + self.width[which] * (chosen + jax.random.uniform(key_place))

    def log_density(self, which: Array, value: Array) -> Float[Array, ""]:
        """Log density of entry `which` up to a constant; -inf outside the table."""
        place = (value - self.low[which]) / self.width[which]
        inside = (place >= 0.0) & (place < BINS)
        share = self.log_share[which, jnp.clip(place, 0, BINS - 1).astype(int)]
        return jnp.where(inside, share, -jnp.inf)


@Program
def _ends(layout: Layout, data: Data) -> Float[Array, "walled 2"]:
    """Ends of each walled entry's table."""
    names = [name for name, _ in layout.shapes if name in WALLED]
    ends = [
        biject_to(data.priors[name].support).inv(
            data.priors[name].icdf(jnp.array([TAILS, 1.0 - TAILS]))
        )
        for name in names
    ]
    return jnp.stack(ends)


def tabulate(
    energy_of: Callable[[Array], float], vector: Array, layout: Layout, data: Data
) -> Table:
    """Conditional density of each walled entry, the rest of the vector held, over its prior's range.

    `energy_of` is the negative log density of the unconstrained vector.
    """
    walled = blocks(layout).walled
    if not walled.size:
        return Table.empty(layout)
    ends = np.asarray(_ends(layout, data))
    widths = (ends[:, 1] - ends[:, 0]) / BINS
    shares = []
    for entry, low, width in zip(walled, ends[:, 0], widths, strict=True):
        points = np.repeat(np.asarray(vector)[None], BINS, axis=0)
        points[:, entry] = low + width * (np.arange(BINS) + 0.5)
        energies = np.array([energy_of(point) for point in points])
        relative = np.exp(-(energies - np.nanmin(energies)))
        relative = np.where(np.isfinite(relative), relative, 0.0)
        # A wall lies within a bin and moves: what is probable on one side of it must not be missed.
        beside = np.pad(relative, 1)
        relative = np.maximum(relative, np.maximum(beside[:-2], beside[2:]))
        share = (1.0 - EVEN_SHARE) * relative / relative.sum() + EVEN_SHARE / BINS
        shares.append(np.log(share))
    return Table(*(jnp.asarray(part) for part in (ends[:, 0], widths, np.stack(shares))))


class WalledProposal(NamedTuple):
    """How far proposals go."""

    stride: Float[Array, " walled"]
    """Standard deviation of the longest local ones."""
    table: Table


class WalledState(NamedTuple):
    """What the moves change."""

    vector: Float[Array, " n"]
    """Unconstrained."""
    energy: Float[Array, ""]
    """Negative log density of the vector."""


def _place(layout: Layout, name: str) -> int:
    """Index of a scalar site in the vector."""
    sizes = [int(np.prod(shape)) for _, shape in layout.shapes]
    return int(np.cumsum([0, *sizes])[[known for known, _ in layout.shapes].index(name)])


def offer_walled(
    key: Array,
    which: Array,
    vector: Float[Array, " n"],
    proposal: WalledProposal,
    tension: Float[Array, ""],
    layout: Layout,
) -> ProposedMove:
    """A proposal for the walled entry `which`, from its table or local; neither needs a gradient.

    A plain proposal moves a minimum force F alone: under `tension` [N], to which it refers,
    taut_strain holds the muscle's length. A sheared one also moves taut_strain, so that C stays: that
    holds the length where the spring is slack. One that carries friction along keeps D / F of MODULUS:
    shut, it stretches by 2 D / F of STRAIN_EPSILON where motion turns, and readings tell that alone.
    Both keep volume, so all are symmetric. A draw from the table is plain, and long: it is weighed by
    the table's density (independence sampler).
    """
    walled = blocks(layout).walled
    taut, friction = _place(layout, "taut_strain"), _place(layout, "D")
    names = [name for name, _ in layout.shapes if name in WALLED]
    stiffness = jnp.asarray([_place(layout, SPRINGS[name]) for name in names])
    shuts = jnp.asarray([name == CARRYING for name in names])
    key_draw, key_step, key_kind = jax.random.split(key, 3)
    carrying, tabling, shearing, reach = jax.random.uniform(key_kind, (4,))
    carries = shuts[which] & (carrying < CARRIED)
    tabled = ~carries & (tabling < TABLED)
    shears = ~carries & ~tabled & (shearing < 0.5)
    longest = jnp.where(carries, REACH, proposal.stride[which])
    # Long and short proposals: a wall near or far from here is reached by either.
    step = longest * jax.random.normal(key_step) * 10.0**-reach
    entry = jnp.asarray(walled)[which]
    before = vector[entry]
    after = jnp.where(tabled, proposal.table.draw(key_draw, which), before + step)
    stiff = jnp.exp(vector[stiffness[which]])
    strains = tensile_strain(tension, stiff, jnp.exp(jnp.stack([before, after])))
    moved = vector.at[entry].set(after)
    moved = moved.at[taut].add(shears * (strains[1] - strains[0]))
    moved = moved.at[friction].add(carries * (after - before))
    table = proposal.table
    back = table.log_density(which, before) - table.log_density(which, after)
    return ProposedMove(moved, jnp.where(tabled, back, 0.0))


def move_walled(
    key: Array,
    state: WalledState,
    energy_at: Callable[[Array], Array],
    offer_at: Callable[[Array, Array, Array], ProposedMove],
    layout: Layout,
) -> WalledState:
    """A proposal for each walled entry in turn, accepted by the energy.

    `offer_at(key, which, vector)` makes it.
    """

    def propose(state: WalledState, now: tuple[Array, Array]) -> tuple[WalledState, None]:
        key_offer, key_accept = jax.random.split(now[0])
        offer = offer_at(key_offer, now[1], state.vector)
        trial = WalledState(offer.vector, energy_at(offer.vector))
        chance = jnp.log(jax.random.uniform(key_accept))
        accept = chance < state.energy - trial.energy + offer.log_odds
        return jax.tree.map(lambda a, b: jnp.where(accept, a, b), trial, state), None

    count = blocks(layout).walled.size
    return jax.lax.scan(propose, state, (jax.random.split(key, count), jnp.arange(count)))[0]
