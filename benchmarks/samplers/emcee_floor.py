"""emcee's stretch moves on the C floor, the quickest density that is not ours."""

import emcee
import jax
import numpy as np
from jaxtyping import Float

from benchmarks.competitors.c_floor import CFloor
from benchmarks.density import log_posterior
from benchmarks.samplers.protocol import Frame, Point, Record, Sampler
from muscle_bayes.inference.problem import Problem


class _Floor(Sampler):
    """Values of the C floor: it finds derivatives too, which no other right way is quick without."""

    def __init__(self, problem: Problem, frame: Frame) -> None:
        super().__init__(problem, frame)
        self._way = CFloor(problem)
        self._around = jax.jit(log_posterior, static_argnames="layout")

    def density(self, vector: Point) -> float:
        q = self._way.coordinates(vector)
        value = float(self._around(vector, q, self.problem.layout, self.problem.data))
        return value if np.isfinite(value) else -np.inf

    def counted(self, z: Point, record: Record) -> float:
        """Log density at a point of the frame."""
        record.evaluations += 1
        return self.density(self.frame.vector(z))


class EmceeFloor(_Floor):
    """An ensemble in each process."""

    name = "emcee on the C floor"
    settings = "stretch moves, 48 walkers"
    walkers = 48
    warmup = 300

    def run(self, starts: Float[np.ndarray, "walker n"], seed: int, record: Record) -> None:
        self.density(self.frame.vector(starts[0]))
        ensemble = emcee.EnsembleSampler(*starts.shape, self.counted, args=(record,))
        ensemble.random_state = np.random.RandomState(seed).get_state()
        record.begin()
        for count, state in enumerate(ensemble.sample(starts, iterations=10**7, store=False)):
            record.add(state.coords, count < self.warmup)
