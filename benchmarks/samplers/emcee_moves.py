"""emcee's stretch moves, on CVODES and on the C floor."""

import emcee
import numpy as np
from jaxtyping import Float

from benchmarks.samplers.protocol import Record
from benchmarks.samplers.values import OnCvodes, OnFloor, Values


class _Emcee(Values):
    """An ensemble in each process."""

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


class EmceeCvodes(OnCvodes, _Emcee):
    """On CVODES."""

    name = "emcee on CVODES"


class EmceeFloor(OnFloor, _Emcee):
    """On the C floor."""

    name = "emcee on the C floor"
