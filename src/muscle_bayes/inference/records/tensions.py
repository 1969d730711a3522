"""The tensions under which a run's muscle stood, from what its files say alone."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.data.run import Run
from muscle_bayes.inference.records.rig import rig
from muscle_bayes.physics.elements import Muscle, NoElement


def log_tensions(run: Run) -> Float[np.ndarray, " row"]:
    """Log of the tension [N] with which side A's muscle balances the load at every row.

        F = m g R_d / |lever(q)|

    Friction and acceleration are left out. Empty where another element pulls, or rows have no load.
    """
    plant = rig(run.metadata)
    if not (isinstance(plant.side_a, Muscle) and isinstance(plant.side_b, NoElement)):
        return np.zeros(0)
    table = run.table[run.table["load"] > 0.0]
    q = run.sensor.coordinate(table["reading"].to_numpy())
    lever = np.abs(np.asarray(plant.side_a.linkage.lever(jnp.asarray(q))))
    return np.log(table["load"].to_numpy() * GRAVITY * plant.load_lever / lever)
