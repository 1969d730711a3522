"""The model's static inverse: what holds each angle."""

import jax
import jax.numpy as jnp
import numpy as np

from muscle_bayes.control.closed_loop import resting_plant, start_of
from muscle_bayes.control.laws.gains import FeedForward
from muscle_bayes.control.plant.draws import JointDraws
from muscle_bayes.control.plant.rest import angles_between
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.physics.bisection import bisect
from muscle_bayes.physics.state import Drive


@double_precision
def static_inverse(
    draws: JointDraws, *, temperatures: bool = False, hottest: float = 90.0, entries: int = 21
) -> FeedForward:
    """For the median of the draws, unloaded: what holds the angles that either muscle reaches at `hottest`.

    Torque balance f(theta, T_A, T_B) = 0 with HYST as it rests in the cold and the other muscle at room
    temperature; then duty = 255 cooling (T - T_room) / gain, or with `temperatures` T - T_room [K] itself.
    """
    joint = draws.median().one()
    plant, heater = resting_plant(joint), joint.heater
    start = start_of(joint, jnp.zeros(()), jnp.zeros(()))
    low, high = angles_between(plant)
    most = hottest - float(heater.room)

    def held(excess):
        """Angle held with B `excess` [K] above the room, or A where it is negative."""
        both = heater.room + jnp.stack([jnp.maximum(-excess, 0.0), jnp.maximum(excess, 0.0)])
        drive, still = Drive(both, jnp.zeros(()), jnp.zeros(())), jnp.zeros(())
        return bisect(lambda q: plant.force(q, still, start.hyst, drive), low, high)

    excess = jnp.linspace(-most, most, entries)
    angle = np.asarray(jax.vmap(held)(excess))
    output = excess if temperatures else heater.holding_duty(excess, 1)
    # Around room temperature contraction may begin with a dead or reversed stretch.
    rising = np.concatenate([[True], np.diff(np.maximum.accumulate(angle)) > 1e-9])
    chosen = np.flatnonzero(rising)
    return FeedForward(
        angle=tuple(float(x) for x in angle[chosen]),
        output=tuple(float(x) for x in np.asarray(output)[chosen]),
    )
