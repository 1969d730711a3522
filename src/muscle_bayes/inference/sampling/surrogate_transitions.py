"""Metropolis steps that a normal surrogate of the posterior proposes, as a block of NumPyro's Gibbs."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from numpyro.infer.gibbs import GIBBS_SITES_KWARG
from numpyro.infer.mcmc import MCMCKernel
from numpyro.util import identity

from muscle_bayes.inference.model.calibration_model import CalibrationModel
from muscle_bayes.inference.model.density import constrain, potential_given, unconstrain
from muscle_bayes.inference.model.lane_model import LanePrediction, predictions
from muscle_bayes.inference.sampling.gibbs_blocks import blocks_of
from muscle_bayes.inference.sampling.slice_sampling import LogDensity
from muscle_bayes.inference.search.tempering import entry_names


class Surrogate(NamedTuple):
    """An approximate density of the smooth entries x and of the noise n: p(n) N(x; centre, root root')."""

    log_marginal: Float[Array, ""]
    """ln p(n), up to a constant."""
    centre: Float[Array, " m"]
    root: Float[Array, "m m"]
    inverse_root: Float[Array, "m m"]
    log_volume: Float[Array, ""]
    """ln |det root|."""


class Swept(NamedTuple):
    """A point after some steps."""

    vector: Float[Array, " n"]
    log_density: Float[Array, ""]
    extra: Any
    """What else the density's function returned there."""
    acceptance: Float[Array, ""]
    """Mean probability of acceptance."""


def sweep(
    key: Array,
    vector: Float[Array, " n"],
    log_density: LogDensity,
    surrogate: Callable[[Array], Surrogate],
    smooth: Int[Array, " m"],
    directions: Float[Array, "k n"],
    *,
    steps: int = 8,
    moves: int = 4,
    nearest: float = 0.01,
) -> Swept:
    """Some steps of the surrogate transition method.

    First the noise moves by random-walk Metropolis steps under the surrogate's marginal. Then the smooth
    entries x are proposed: x' = c' + R' u', u' = sqrt(1 - b^2) u + b e with u = R^-1 (x - c) and e standard
    normal (preconditioned Crank-Nicolson). So they are carried along as noise makes their normal wider and
    moves it. Both leave the surrogate q as it is and are reversible: the step is accepted with probability
    min(1, p(x', n') q(x, n) / (p(x, n) q(x', n'))). It costs one value of the density p, and no gradient.
    In one step in two the noise stays, and in half of these b is small, log-uniform down to `nearest`; else
    sqrt(1 - b^2) is uniform on (0, 1). Far from where the surrogate holds, such steps alone are accepted.

    Sources: Liu, Monte Carlo Strategies in Scientific Computing (2001), section 9.4.3; Christen and Fox,
    J. Comput. Graph. Stat. 14 (2005), 795-810; Cotter, Roberts, Stuart and White, Statistical Science 28
    (2013), section 4.

    Args:
        key: random key.
        vector: where to start.
        log_density: ln p of a vector, and what else was computed there.
        surrogate: of a vector; it must not depend on the smooth entries.
        smooth: their places.
        directions: along which the noise moves, each with its largest scale.
        steps: proposals.
        moves: of the noise, in each.
        nearest: smallest scale of a step, in the surrogate's standard deviations.
    """

    def moved(now: tuple, key: Array) -> tuple[tuple, None]:
        place, near, stays, first = now
        key_which, key_size, key_way, key_accept = jax.random.split(key, 4)
        direction = jax.random.choice(key_which, directions)
        size = 10.0 ** -jax.random.uniform(key_size) * jax.random.normal(key_way)
        further = place + jnp.where(stays, 0.0, size) * direction
        there = surrogate(further)
        rise = there.log_marginal - near.log_marginal
        accepted = first | (jnp.log(jax.random.uniform(key_accept)) < rise)
        further, there = _either(accepted, (further, there), (place, near))
        return (further, there, stays, first), None

    def step(now: tuple, one: tuple[Array, Array]) -> tuple[tuple, Array]:
        place, near, _, _, weight = now
        key, first = one
        key_noise, key_kind, key_size, key_kick, key_accept = jax.random.split(key, 5)
        kind = jax.random.uniform(key_kind)
        stays, is_near = kind < 0.5, kind < 0.25
        begun = place, near, stays | first, first
        keys = jax.random.split(key_noise, moves)
        (noisy, there_near, *_), _ = jax.lax.scan(moved, begun, keys)
        near = _either(first, there_near, near)
        uniform = jax.random.uniform(key_size)
        size = jnp.where(is_near, nearest**uniform, jnp.sqrt(1.0 - uniform**2))
        size = jnp.where(first, 0.0, size)
        u = near.inverse_root @ (place[smooth] - near.centre)
        u = jnp.sqrt(1.0 - size**2) * u + size * jax.random.normal(key_kick, u.shape)
        x = jnp.where(first, place[smooth], there_near.centre + there_near.root @ u)
        further = noisy.at[smooth].set(x)
        there, extra = log_density(further)
        there_weight = there - (there_near.log_marginal - 0.5 * u @ u - there_near.log_volume)
        there_weight = jnp.where(jnp.isnan(there_weight), -jnp.inf, there_weight)
        chance = jnp.exp(jnp.minimum(0.0, there_weight - weight))
        accepted = first | (jax.random.uniform(key_accept) < chance)
        proposal = further, there_near, there, extra, there_weight
        return _either(accepted, proposal, (place, near, *now[2:])), jnp.where(first, 0.0, chance)

    # The first look is at the present point: surrogate and density are compiled in one place only.
    seen = jax.eval_shape(lambda v: (surrogate(v), *log_density(v)), vector)
    near, here, extra = jax.tree.map(lambda one: jnp.zeros(one.shape, one.dtype), seen)
    begun = vector, near, here, extra, jnp.full((), -jnp.inf, vector.dtype)
    keys, looks = jax.random.split(key, steps + 1), jnp.arange(steps + 1) == 0
    (vector, _, here, extra, _), chances = jax.lax.scan(step, begun, (keys, looks))
    return Swept(vector, here, extra, jnp.sum(chances) / steps)


def _either[T](first: Array, one: T, other: T) -> T:
    """The one where `first`, else the other."""
    return jax.tree.map(lambda a, b: jnp.where(first, a, b), one, other)


class SurrogateState(NamedTuple):
    """State of `SurrogateTransitions`."""

    z: dict[str, Array]
    """The block's sites, constrained."""
    place: Float[Array, " n"]
    """All sites, unconstrained."""
    about: Any
    """Of which the surrogate is made; to be set before the first draw."""
    accept_prob: Float[Array, ""]
    potential_energy: Float[Array, ""]
    """Negative log density of all unconstrained sites."""
    rng_key: Array


class SurrogateTransitions(MCMCKernel):
    """`sweep` over the smooth sites and the noise of a calibration model, then slices of the noise.

    The slices need no simulation: they are taken on the last prediction.

    The density is the model's, as `potential_given` has it for all its unconstrained sites.

    Args:
        model: of the runs.
        surrogate: from the state's `about`, the unconstrained vector and the data.
        smooth: places of the smooth entries.
        directions, steps, moves: as in `sweep`.
        slices: of the noise, from key, values, prediction and data.
    """

    sample_field = "z"

    def __init__(
        self,
        model: CalibrationModel,
        surrogate: Callable[..., Surrogate],
        smooth: Int[Array, " m"],
        directions: Float[Array, "k n"],
        slices: Callable[..., dict[str, Array]],
        *,
        steps: int,
        moves: int,
    ) -> None:
        self._slices = slices
        self._model, self._layout = model, model.problem.layout
        self._surrogate = surrogate
        self._smooth, self._directions = smooth, directions
        self._steps, self._moves = steps, moves

    @property
    def model(self) -> CalibrationModel:
        """The model."""
        return self._model

    def init(
        self,
        rng_key: Array,
        num_warmup: int,
        init_params: Mapping[str, Array],
        model_args: Any,
        model_kwargs: Any,
    ) -> SurrogateState:
        """A first state, without `about`."""
        others = (model_kwargs or {}).get(GIBBS_SITES_KWARG, {})
        place = unconstrain({**others, **init_params}, self._layout, model_args[0])
        nothing = jnp.zeros(())
        return SurrogateState(dict(init_params), place, None, nothing, nothing, rng_key)

    def sample(self, state: SurrogateState, model_args: Any, model_kwargs: Any) -> SurrogateState:
        """One sweep."""
        (data,), layout = model_args, self._layout
        key, key_sweep, key_noise = jax.random.split(state.rng_key, 3)
        place = self._with_others(state, (model_kwargs or {}).get(GIBBS_SITES_KWARG, {}), data)

        def log_density(vector: Array) -> tuple[Array, list[LanePrediction]]:
            predicted = predictions(constrain(vector, layout, data), layout, data)
            return -potential_given(predicted, vector, layout, data), predicted

        found = sweep(
            key_sweep,
            place,
            log_density,
            lambda vector: self._surrogate(state.about, vector, data),
            self._smooth,
            self._directions,
            steps=self._steps,
            moves=self._moves,
        )
        values = constrain(found.vector, layout, data)
        values |= self._slices(key_noise, values, found.extra, data)
        noise = unconstrain(values, layout, data)
        sliced = np.isin(entry_names(layout), blocks_of([n for n, _ in layout.shapes]).noise)
        vector = jnp.where(sliced, noise, found.vector)
        return SurrogateState(
            {name: values[name] for name in state.z},
            vector,
            state.about,
            found.acceptance,
            potential_given(found.extra, vector, layout, data),
            key,
        )

    def _with_others(self, state: SurrogateState, others: Mapping[str, Array], data: Any) -> Array:
        """The whole vector: this block's entries as they were, the other sites as they are now."""
        whole = unconstrain({**state.z, **others}, self._layout, data)
        own = [jnp.full(shape, name in state.z).ravel() for name, shape in self._layout.shapes]
        return jnp.where(jnp.concatenate(own), state.place, whole)

    def refresh(self, state: SurrogateState, model_args: Any, model_kwargs: Any) -> SurrogateState:
        """Identity: a sweep begins with the density at the present point."""
        return state

    def wrap_model(self, wrapper: Callable[..., Any]) -> "SurrogateTransitions":
        """Itself: other sites' values come with the arguments."""
        return self

    def get_constrain_fn(self, model_args: Any, model_kwargs: Any) -> Callable[..., Any]:
        """Identity: the block's values are constrained."""
        return identity

    def get_diagnostics_str(self, state: SurrogateState) -> str:
        return f"acc. prob={float(state.accept_prob):.2f}"
