"""Metropolis steps about a normal approximation, a kernel of NumPyro's."""

import copy
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Float
from numpyro import distributions as dist
from numpyro.handlers import substitute, trace
from numpyro.infer.mcmc import MCMCKernel
from numpyro.infer.util import log_density
from numpyro.util import identity


class CrankNicolsonState(NamedTuple):
    """State of `CrankNicolson`."""

    z: dict[str, Array]
    """The block's sites, constrained."""
    place: Float[Array, " n"]
    """The same, unconstrained, in the order of their names."""
    centre: Float[Array, " n"]
    """Mean of the normal approximation, in the coordinates of `place`."""
    root: Float[Array, "n n"]
    """Lower Cholesky factor of its covariance."""
    accept_prob: Float[Array, ""]
    """Mean acceptance probability of the last sweep."""
    potential_energy: Float[Array, ""]
    """Negative log density of the unconstrained sites, the others given."""
    rng_key: Array


class CrankNicolson(MCMCKernel):
    """Preconditioned Crank-Nicolson steps about a normal approximation of the posterior.

    From x, x' = m + k (x - m) + sqrt(1 - k^2) L e is proposed, with e standard normal. This keeps
    the approximation N(m, L L') as it is; x' is accepted with probability min(1, w(x') / w(x)), w the
    ratio of posterior and approximation. The correlation k is drawn anew for each step: at k = 0 the
    proposal does not depend on x, near 1 it stays close. Where the approximation is good, a step costs
    one value of the density, and no gradient, and most are accepted.

    Source: Cotter, Roberts, Stuart and White, MCMC methods for functions, Statistical Science 28
    (2013), section 4.

    Args:
        model: a NumPyro model. Its latent sites outside the block are conditioned on.
        steps: proposals of a sweep.
    """

    sample_field = "z"

    def __init__(self, model: Callable[..., Any], steps: int = 8) -> None:
        self._model = model
        self._steps = steps

    @property
    def model(self) -> Callable[..., Any]:
        """The model."""
        return self._model

    def init(
        self,
        rng_key: Array,
        num_warmup: int,
        init_params: Mapping[str, Array],
        model_args: Any,
        model_kwargs: Any,
    ) -> CrankNicolsonState:
        """A first state; `centre` and `root` are to be replaced by the approximation's."""
        size = ravel_pytree(dict(init_params))[0].size
        nothing = jnp.zeros(())
        return CrankNicolsonState(
            dict(init_params),
            jnp.zeros(size),
            jnp.zeros(size),
            jnp.eye(size),
            nothing,
            nothing,
            rng_key,
        )

    def sample(
        self, state: CrankNicolsonState, model_args: Any, model_kwargs: Any
    ) -> CrankNicolsonState:
        """One sweep."""
        kwargs = model_kwargs or {}
        sites = trace(substitute(self._model, data=state.z)).get_trace(*model_args, **kwargs)
        transforms = {name: dist.biject_to(sites[name]["fn"].support) for name in state.z}
        free = {name: transforms[name].inv(value) for name, value in state.z.items()}
        start, unravel = ravel_pytree(free)

        def constrained(point: Array) -> dict[str, Array]:
            return {name: transforms[name](part) for name, part in unravel(point).items()}

        def log_posterior(point: Array) -> Array:
            values = constrained(point)
            volumes = [
                jnp.sum(transforms[name].log_abs_det_jacobian(part, values[name]))
                for name, part in unravel(point).items()
            ]
            joint, _ = log_density(self._model, model_args, kwargs, values)
            return joint + sum(volumes)

        def step(now: tuple[Array, Array, Array], one: tuple[Array, Array]) -> Any:
            point, _, weight = now
            key, first = one
            key_near, key_kick, key_accept = jax.random.split(key, 3)
            near = jnp.where(first, 1.0, jax.random.uniform(key_near))
            kick = state.root @ jax.random.normal(key_kick, point.shape)
            moved = near * (point - state.centre) + jnp.sqrt(1.0 - near**2) * kick
            further = jnp.where(first, point, state.centre + moved)
            there = log_posterior(further)
            away = solve_triangular(state.root, further - state.centre, lower=True)
            there_weight = there + 0.5 * away @ away
            there_weight = jnp.where(jnp.isnan(there_weight), -jnp.inf, there_weight)
            chance = jnp.exp(jnp.minimum(0.0, there_weight - weight))
            accepted = first | (jax.random.uniform(key_accept) < chance)
            now = jax.tree.map(
                lambda a, b: jnp.where(accepted, a, b), (further, there, there_weight), now
            )
            return now, jnp.where(first, 0.0, chance)

        # The first look is at the present point, for its density may be another since the last sweep.
        key, key_steps = jax.random.split(state.rng_key)
        keys = jax.random.split(key_steps, self._steps + 1)
        low = jnp.full((), -jnp.inf, start.dtype)
        (point, density, _), chances = jax.lax.scan(
            step, (start, low, low), (keys, jnp.arange(self._steps + 1) == 0)
        )
        mean_chance = jnp.sum(chances) / self._steps
        return state._replace(
            z=constrained(point),
            place=point,
            accept_prob=mean_chance,
            potential_energy=-density,
            rng_key=key,
        )

    def refresh(
        self, state: CrankNicolsonState, model_args: Any, model_kwargs: Any
    ) -> CrankNicolsonState:
        """Identity: a sweep begins with the density at the present point."""
        return state

    def wrap_model(self, wrapper: Callable[..., Any]) -> "CrankNicolson":
        """A kernel of the wrapped model."""
        kernel = copy.copy(self)
        kernel._model = wrapper(self._model)
        return kernel

    def get_constrain_fn(self, model_args: Any, model_kwargs: Any) -> Callable[..., Any]:
        """Identity: the block's values are constrained."""
        return identity

    def get_diagnostics_str(self, state: CrankNicolsonState) -> str:
        return f"acc. prob={float(state.accept_prob):.2f}"
