"""nutpie's NUTS on CasADi with CVODES as a black box: PyMC's models through nutpie's sampler."""

from collections.abc import Callable

import numpy as np
import nutpie
from jaxtyping import Float
from nutpie.compiled_pyfunc import from_pyfunc

from benchmarks.samplers.cvodes_nuts import CvodesNuts
from benchmarks.samplers.protocol import Point, Record, whitened


class NutpieCasadi(CvodesNuts):
    """`nutpie.sample` of a Python function."""

    name = "nutpie NUTS on CVODES"

    def run(self, starts: Float[np.ndarray, "walker n"], seed: int, record: Record) -> None:
        call = whitened(self.way, self.frame, record)
        size, drawn = starts.shape[1], 0
        self.way(self.frame.vector(starts[0]))

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
