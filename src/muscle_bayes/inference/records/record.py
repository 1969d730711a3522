"""What the readings of a run are on the grid on which it is simulated."""

from typing import NamedTuple

from jaxtyping import Array, Float

from muscle_bayes.physics.schedule import Schedule


class Record(NamedTuple):
    """One run, or one segment of it, on its grid. Arrays are NumPy until they are stacked."""

    schedule: Schedule
    time: Float[Array, " interval"]
    """When the averaged readings were taken [s after the run's first row]; of slow runs, the middle."""
    reading: Float[Array, " interval"]
    """Mean reading [the log's unit]."""
    weight: Float[Array, " interval"]
    """Number of independent readings in the mean; 0 where nothing is observed."""
    coarse: Float[Array, " interval"]
    """Variance of quantisation error in the mean, in squared quanta."""
    jolted: Float[Array, " interval"]
    """Variance that a jump of the load adds to the discrepancy [log's unit^2]."""
    start_reading: float
    """First reading of the record, of slow runs the mean of the first ones [the log's unit]."""
    start_speed: float
    """Slope of the first readings [log's unit per s]."""
    deceleration: Float[Array, "node 2"]
    """How heating or cooling of both sides slows down towards a turn [C/s^2]; 0 of fast runs."""
    heat_variance: Float[Array, "interval 2"]
    """Variance of the temperature of both sides [C^2]."""
    imposed: Float[Array, "interval 2"] | None = None
    """Mean coordinate [rad or m] and speed that are imposed; None where the plant moves by itself."""
