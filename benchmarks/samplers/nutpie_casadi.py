"""nutpie's NUTS on CasADi with CVODES as a black box: PyMC's models through nutpie's sampler."""

from collections.abc import Callable

import numpy as np
import nutpie
from jaxtyping import Float
from nutpie.compiled_pyfunc import from_pyfunc

from benchmarks.competitors.casadi_cvodes import CasadiCvodes
from benchmarks.ode import COARSE_ERROR, damping_for
from benchmarks.samplers.protocol import Frame, Point, Record, Sampler, whitened
from benchmarks.samplers.settings import TOLERANCE, WARMUP
from muscle_bayes.inference.problem import Problem


class NutpieCasadi(Sampler):
    """`nutpie.sample` of a Python function."""

    name = "nutpie NUTS on CVODES"
    settings = "NUTS, diagonal mass matrix and step adapted"
    warmup = WARMUP

    def __init__(self, problem: Problem, frame: Frame) -> None:
        super().__init__(problem, frame)
        self._way = CasadiCvodes(problem, damping_for(COARSE_ERROR), TOLERANCE)

    def density(self, vector: Point) -> float:
        return self._way(vector)[0]

    def run(self, starts: Float[np.ndarray, "walker n"], seed: int, record: Record) -> None:
        call = whitened(self._way, self.frame, record)
        size, drawn = starts.shape[1], 0
        self._way(self.frame.vector(starts[0]))

        def expanding(*_: int) -> Callable:
            def expand(z: Point) -> dict[str, np.ndarray]:
                nonlocal drawn
                record.add(z[None], drawn < self.warmup)
                drawn += 1
                return {"z": np.array(z)}

            return expand

        model = from_pyfunc(
            size,
            lambda: call,
            expanding,
            [np.dtype(float)],
            [(size,)],
            ["z"],
            make_initial_point_fn=lambda _: starts[0],
        )
        record.diverging = -1
        nutpie.sample(
            model, draws=10**6, tune=self.warmup, chains=1, cores=1, seed=seed, progress_bar=False
        )
