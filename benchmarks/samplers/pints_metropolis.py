"""PINTS's adaptive Metropolis, on CVODES and on the C floor."""

import numpy as np
import pints
from jaxtyping import Float

from benchmarks.samplers.protocol import Record
from benchmarks.samplers.values import OnCvodes, OnFloor, Values


class _Pints(Values):
    """Haario and Bardenet's adaptive covariance, begun from the Fisher information's."""

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


class PintsCvodes(OnCvodes, _Pints):
    """On CVODES."""

    name = "PINTS on CVODES"


class PintsFloor(OnFloor, _Pints):
    """On the C floor."""

    name = "PINTS on the C floor"
