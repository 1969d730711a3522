"""How inertia carries a rotor past the rest that slow motion would give it."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.plant import Drive, Plant

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


def overshoot(plant: Plant, q: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
    """c J / k [s^2]: sliding ends as if temperature were ahead by this times its braking.

    Between dry friction's two limits a rotor of inertia J on stiffness k does not glide after its
    moving equilibrium x(t) but goes in jumps of half a period, each of which starts from rest. Where
    x slows down towards a turn with x'' = -a, the last jump ends past the turn by c a J / k, c
    between -0.07 and 6.2 with the phase at which sliding began. Averaged over that phase c = 4.19;
    c = 1 where damping ends the oscillation during a slide, or where nothing sticks (from
    y'' + 2 zeta y' + y = x, x = -t^2/2, sticking at y' = 0). Since x follows the temperature, this
    equals the path of a rotor without inertia at T + c J / k times (-T''). k is that of the state
    given.
    """
    still = jnp.zeros_like(q)
    unit = jnp.ones_like(q)
    stiffness = -jax.jvp(lambda x: plant.force(x, still, hyst, drive), (q,), (unit,))[1]
    damping = -jax.jvp(lambda v: plant.force(q, v, hyst, drive), (still,), (unit,))[1]
    inertia = plant.inertia(drive.load)
    heavy = inertia > 0.0
    mass = jnp.where(heavy, inertia, 1.0)
    spring = jnp.maximum(stiffness, mass / LONGEST_SWING)
    ratio = 0.5 * jnp.maximum(damping, 0.0) / jnp.sqrt(spring * mass)
    times = jnp.where(plant.friction.dry > 0.0, lead(ratio), DAMPED_LEAD)
    return jnp.where(heavy, times * mass / spring, 0.0)
