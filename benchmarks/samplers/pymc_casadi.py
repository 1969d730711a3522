"""PyMC's NUTS on CasADi with CVODES as a black box: PyMC has no solver for stiff equations of its own."""

from typing import Any, cast

import numpy as np
import pymc as pm
import pytensor.tensor as pt
from jaxtyping import Float
from pytensor.graph.basic import Apply
from pytensor.graph.op import Op

from benchmarks.samplers.cvodes_nuts import CvodesNuts
from benchmarks.samplers.protocol import Record, whitened


class _Black(Op):
    """Log density and its gradient in z; the one call gives both."""

    itypes = (pt.dvector,)
    otypes = (pt.dscalar, pt.dvector)

    def __init__(self, call: Any) -> None:
        self._call = call

    def perform(self, node: Apply, inputs: Any, outputs: Any) -> None:
        value, gradient = self._call(inputs[0])
        outputs[0][0], outputs[1][0] = np.asarray(value), np.asarray(gradient)

    def pullback(self, inputs: Any, outputs: Any, cotangents: Any) -> list[Any]:
        """The gradient of the value; nobody asks for that of the gradient."""
        return [cotangents[0] * outputs[1]]


class PymcCasadi(CvodesNuts):
    """`pm.sample` of a flat vector with a potential."""

    name = "PyMC NUTS on CVODES"

    def run(self, starts: Float[np.ndarray, "walker n"], seed: int, record: Record) -> None:
        black = _Black(whitened(self.way, self.frame, record))
        size = starts.shape[1]
        self.way(self.frame.vector(starts[0]))
        with pm.Model():
            z = pm.Flat("z", shape=size)
            value, _ = cast(list[Any], black(z))
            pm.Potential("density", value)
            step = pm.NUTS(
                potential=pm.step_methods.hmc.quadpotential.QuadPotentialDiagAdapt(
                    size, starts[0], np.ones(size), 10
                )
            )

            def seen(trace: Any, draw: Any) -> None:
                diverging = bool(draw.stats[0]["diverging"])
                record.add(draw.point["z"][None], draw.tuning, diverging)

            pm.sample(
                draws=10**6,
                tune=self.warmup,
                chains=1,
                cores=1,
                step=step,
                initvals={"z": starts[0]},
                random_seed=seed,
                callback=seen,
                progressbar=False,
                compute_convergence_checks=False,
            )
