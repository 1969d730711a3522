"""How inertia carries a rotor past the rest that slow motion would give it."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.friction import DryLevels
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.plant import Drive, Plant
from muscle_bayes.physics.schedule import Schedule
from muscle_bayes.physics.slide import settle

FREE_LEAD, DAMPED_LEAD = 4.19, 1.0
"""Mean overshoot in units of |x''| J / k, without and with damping that ends the oscillation."""
LASTING_DAMPING = 0.043
"""Damping ratio at which the oscillation lasts for about as long as a slide."""
LONGEST_SWING = 0.25
"""Largest J / k that is taken for a swing of the rotor and not for slackness, s^2."""


def lead(damping: Scalar | float) -> Scalar:
    """Mean overshoot of a rotor that jumps, in units of |x''| J / k, at a damping ratio."""
    lasts = jnp.exp(-((damping / LASTING_DAMPING) ** 3))
    return DAMPED_LEAD + (FREE_LEAD - DAMPED_LEAD) * lasts


def overshoot(plant: Plant, q: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Float[Array, "2"]:
    """c J / k [s^2] towards -q and +q: sliding ends as if temperature were ahead by this times its braking.

    Between dry friction's two limits a rotor of inertia J on stiffness k does not glide after its
    moving equilibrium x(t) but goes in jumps of half a period, each of which starts from rest. Where
    x slows down towards a turn with x'' = -a, the last jump ends past the turn by c a J / k, c
    between -0.07 and 6.2 with the phase at which sliding began. Averaged over that phase c = 4.19;
    c = 1 where damping ends the oscillation during a slide, or where nothing sticks (from
    y'' + 2 zeta y' + y = x, x = -t^2/2, sticking at y' = 0). Since x follows the temperature, this
    equals the path of a rotor without inertia at T + c J / k times (-T''). k is that of a rotor which
    slides that way, its springs under a tension that friction adds to or takes from; so it does not
    depend on where in its dead band the rotor is.
    """
    still = jnp.zeros_like(q)
    dry = plant.friction.dry

    def towards(direction: Scalar) -> Scalar:
        held = drive._replace(applied=drive.applied - direction * dry)
        there = settle(plant, q, hyst, held, still, DryLevels(still, still))
        return _lead_time(plant, there, hyst, drive)

    return jax.vmap(towards)(jnp.array([-1.0, 1.0]))


def _lead_time(plant: Plant, q: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
    """c J / k at a state."""
    still, unit = jnp.zeros_like(q), jnp.ones_like(q)
    stiffness = -jax.jvp(lambda x: plant.force(x, still, hyst, drive), (q,), (unit,))[1]
    damping = -jax.jvp(lambda v: plant.force(q, v, hyst, drive), (still,), (unit,))[1]
    inertia = plant.inertia(drive.load)
    heavy = inertia > 0.0
    mass = jnp.where(heavy, inertia, 1.0)
    spring = jnp.maximum(stiffness, mass / LONGEST_SWING)
    ratio = 0.5 * jnp.maximum(damping, 0.0) / jnp.sqrt(spring * mass)
    times = jnp.where(plant.friction.dry > 0.0, lead(ratio), DAMPED_LEAD)
    return jnp.where(heavy, times * mass / spring, 0.0)


def ahead(
    plant: Plant, q: Scalar, hyst: Float[Array, "2"], schedule: Schedule
) -> Float[Array, "node 2"]:
    """By how much both sides' temperatures seem ahead [C], at every node."""
    first, still = schedule.first, jnp.zeros_like(q)

    def pull(side: int, temperature: Scalar) -> Scalar:
        warmed = first.temperature.at[side].set(temperature)
        return plant.force(q, still, hyst, first._replace(temperature=warmed))

    ends = jnp.max(schedule.temperature, 0), jnp.min(schedule.temperature, 0)
    heated = jnp.stack([pull(side, ends[0][side]) - pull(side, ends[1][side]) for side in (0, 1)])
    falling, rising = overshoot(plant, q, hyst, first)
    return jnp.where(heated * schedule.braking > 0.0, rising, falling) * schedule.braking
