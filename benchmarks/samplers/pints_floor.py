"""PINTS's adaptive Metropolis on the C floor, the quickest density that is not ours."""

import numpy as np
import pints
from jaxtyping import Float

from benchmarks.samplers.emcee_floor import _Floor
from benchmarks.samplers.protocol import Record


class PintsFloor(_Floor):
    """Haario and Bardenet's adaptive covariance, begun from the Fisher information's."""

    name = "PINTS on the C floor"
    settings = "Haario-Bardenet adaptive covariance"
    warmup = 5000

    def run(self, starts: Float[np.ndarray, "walker n"], seed: int, record: Record) -> None:
        np.random.seed(seed)  # noqa: NPY002, PINTS draws from the global state
        self.density(self.frame.vector(starts[0]))
        size = starts.shape[1]
        chain = pints.HaarioBardenetACMC(starts[0], np.eye(size) * 2.38**2 / size)
        record.begin()
        done = 0
        while True:
            told = chain.tell(self.counted(chain.ask(), record))
            if told is not None:
                record.add(told[0][None], done < self.warmup)
                done += 1
