"""NumPyro's NUTS: on diffrax as it is generally used, and on our density, to tell the two apart."""

from abc import abstractmethod
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.infer.hmc import hmc

from benchmarks.competitors.generic_diffrax import GenericDiffrax
from benchmarks.ode import COARSE_ERROR, damping_for
from benchmarks.samplers.protocol import Frame, Point, Record, Sampler, our_density
from benchmarks.samplers.settings import TOLERANCE, WARMUP
from muscle_bayes.inference.model.density import potential
from muscle_bayes.inference.model.problem import Problem


class _Nuts(Sampler):
    settings = "NUTS, diagonal mass matrix and step adapted"
    warmup = WARMUP

    @abstractmethod
    def energy(self) -> tuple[Callable, tuple]:
        """Negative log density as a traced function of a vector and of arrays, and these arrays."""

    def run(self, starts: Float[np.ndarray, "walker n"], seed: int, record: Record) -> None:
        function, arrays = self.energy()

        def of(arrays: tuple, mode: Array, factor: Array) -> Callable:
            return lambda z: function(mode + factor @ z, *arrays)

        begin, sample = hmc(potential_fn_gen=of, algo="NUTS")
        given = arrays, jnp.asarray(self.frame.mode), jnp.asarray(self.frame.factor)
        state = begin(
            jnp.asarray(starts[0]),
            num_warmup=self.warmup,
            model_args=given,
            rng_key=jax.random.key(seed),
        )
        step = jax.jit(lambda state, given: sample(state, model_args=given))
        compiled = step.lower(state, given).compile()
        record.begin()
        while True:
            tuning = int(state.i) < self.warmup
            state = jax.block_until_ready(compiled(state, given))
            record.evaluations += int(state.num_steps)
            record.add(np.asarray(state.z)[None], tuning, bool(state.diverging))


class NumpyroDiffrax(_Nuts):
    """On Kvaerno5 with a PID controller, its gradient in forward mode."""

    name = "NumPyro NUTS on diffrax"

    def __init__(self, problem: Problem, frame: Frame) -> None:
        super().__init__(problem, frame)
        self._way = GenericDiffrax(problem, damping_for(COARSE_ERROR), TOLERANCE)

    def density(self, vector: Point) -> float:
        return self._way(vector)[0]

    def energy(self) -> tuple[Callable, tuple]:
        @jax.custom_vjp
        def energy(vector: Array, arrays: tuple) -> Array:
            return forward(vector, arrays)[0]

        def forward(vector: Array, arrays: tuple) -> tuple[Array, Array]:
            value, gradient = self._way.traced(vector, *arrays)
            # A failed solve has no density.
            found = jnp.isfinite(value) & jnp.isfinite(gradient).all()
            return jnp.where(found, -value, jnp.inf), jnp.where(found, -gradient, 0.0)

        def backward(gradient: Array, weight: Array) -> tuple[Array, None]:
            return weight * gradient, None

        energy.defvjp(forward, backward)
        return lambda vector, *arrays: energy(vector, arrays), self._way.arrays


class NumpyroOurs(_Nuts):
    """On our density: what remains is our sampler's part."""

    name = "NumPyro NUTS on our density"

    def density(self, vector: Point) -> float:
        return our_density(self.problem)(vector)

    def energy(self) -> tuple[Callable, tuple]:
        layout = self.problem.layout
        return lambda vector, data: potential(vector, layout, data), (self.problem.data,)
