"""Feed-forward through the muscle model: the duty that holds each angle."""

import jax
import jax.numpy as jnp
import numpy as np

from muscle_bayes.control.closed_loop import resting_plant, start_of
from muscle_bayes.control.draws import JointDraws
from muscle_bayes.control.gains import FeedForward
from muscle_bayes.control.rest import angles_between, bisect
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.physics.plant import Drive

ENTRIES = 21
HOTTEST = 90.0
"""Temperature beyond which no muscle is sent to hold an angle [C]: that of its training."""


@double_precision
def feedforward_of(draws: JointDraws) -> FeedForward:
    """For the mean of the draws, unloaded: torque balance f(theta, T_A, T_B) = 0 with HYST as it rests in
    the cold and the other muscle at room temperature; then duty = 255 cooling (T - T_room) / gain.

    The table covers the angles that either muscle reaches at HOTTEST.
    """
    joint = draws.mean().one()
    plant, heater = resting_plant(joint), joint.heater
    start = start_of(joint, jnp.zeros(()), jnp.zeros(()))
    low, high = angles_between(plant)
    most = HOTTEST - float(heater.room)

    def held(excess):
        """Angle held with B `excess` [K] above the room, or A where it is negative."""
        both = heater.room + jnp.stack([jnp.maximum(-excess, 0.0), jnp.maximum(excess, 0.0)])
        drive = Drive(both, jnp.zeros(()), jnp.zeros(()))
        still = jnp.zeros(())
        return bisect(lambda q: plant.force(q, still, start.hyst, drive), low, high)

    excess = jnp.linspace(-most, most, ENTRIES)
    angle, duty = jax.vmap(held)(excess), heater.holding_duty(excess)
    # Around room temperature contraction may begin with a dead or reversed stretch.
    rising = np.concatenate([[True], np.diff(np.maximum.accumulate(np.asarray(angle))) > 1e-9])
    chosen = np.flatnonzero(rising)
    return FeedForward(
        angle=tuple(float(x) for x in np.asarray(angle)[chosen]),
        output=tuple(float(x) for x in np.asarray(duty)[chosen]),
    )
