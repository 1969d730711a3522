"""Metropolis steps that a surrogate of the posterior proposes, as a block of NumPyro's Gibbs."""

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


class Rough(NamedTuple):
    """A normal of the smooth entries under some noise, more or less: N(centre, root root')."""

    centre: Float[Array, " m"]
    root: Float[Array, "m m"]
    inverse_root: Float[Array, "m m"]
    log_volume: Float[Array, ""]
    """ln |det root|, up to a constant."""


class Surrogate[T](NamedTuple):
    """An approximate density that costs little."""

    under: Callable[[Array], tuple[T, Rough]]
    """What it needs of a vector's noise, that is of all entries but the smooth ones."""
    log_density: Callable[[T, Array, Array], Float[Array, ""]]
    """Of a vector, given that, with the likelihood raised to a power."""


class Swept(NamedTuple):
    """A point after some steps."""

    vector: Float[Array, " n"]
    log_density: Float[Array, ""]
    extra: Any
    """What else the density's function returned there."""
    acceptance: Float[Array, ""]
    """Mean probability of acceptance."""


class _Place[T](NamedTuple):
    """Where a chain on the surrogate is."""

    vector: Float[Array, " n"]
    under: tuple[T, Rough]
    log_density: Float[Array, ""]
    """Of the surrogate."""


_STAY, _LOOK, _MOVE, _SWING = range(4)
"""Kinds of steps on the surrogate: none; a look at the place; the noise moves; the smooth entries do."""


def sweep[T](
    key: Array,
    vector: Float[Array, " n"],
    log_density: LogDensity,
    surrogate: Callable[[Array], Surrogate[T]],
    smooth: Int[Array, " m"],
    directions: Float[Array, "k n"],
    *,
    steps: int = 8,
    moves: int = 4,
    swings: int = 3,
    leaps: int = 48,
    longest: float = 0.15,
    nearest: float = 0.01,
    sorts: tuple[float, float, float, float] = (0.4, 0.15, 0.25, 0.2),
    powers: tuple[float, float] = (1.0, 0.5),
    second: float = 0.25,
) -> Swept:
    """Some steps of the surrogate transition method.

    Each runs a chain on the surrogate q: half of the noise's moves, swings of the smooth entries, the other
    half of the moves. A move of the noise is a random-walk Metropolis step that carries the smooth entries
    along, by the rough normals before and after it. A swing is a Hamiltonian trajectory. The sequence is
    the same backwards, so its end is accepted with probability min(1, p(x') q(x) / (p(x) q(x'))), p being
    the density. It costs one value of p, and no gradient of it. Some steps are
    not whole: they move the noise alone, or are swings alone, or a single short one. Far from where the
    surrogate holds, such small steps alone are accepted.

    Sources: Liu, Monte Carlo Strategies in Scientific Computing (2001), section 9.4.3; Christen and Fox,
    J. Comput. Graph. Stat. 14 (2005), 795-810; Neal, Handbook of Markov Chain Monte Carlo (2011), ch. 5.

    Args:
        key: random key.
        vector: where to start.
        log_density: ln p of a vector, and what else was computed there.
        surrogate: q, of a number: 0, or by and by 1, which may serve where the first is poor.
        smooth: places of the entries that swing.
        directions: along which the noise moves, each with its largest scale.
        steps: proposals.
        moves: of the noise, in each.
        swings: in each.
        leaps: of the leapfrog method, in each swing.
        longest: leap, in standard deviations of the rough normal.
        nearest: shortest one of short swings, as a share of that.
        sorts: probabilities of a whole step, of the noise alone, of swings alone, of one short swing.
        powers: of the surrogate's likelihood, one of them in each step. By the lower one, chains leave
            where the surrogate is too narrow.
        second: share of the steps by the second surrogate.
    """
    half = [_MOVE] * (moves // 2)
    walk = jnp.array([_LOOK, *half, *[_SWING] * swings, *half])
    alone = jnp.where(walk == _SWING, _STAY, walk)
    still = jnp.where(walk == _MOVE, _STAY, walk)
    middle = 1 + len(half)
    look = jnp.full(len(walk), _STAY).at[0].set(_LOOK)
    near = look.at[middle].set(_SWING)

    def step(now: tuple, one: tuple[Array, Array]) -> tuple[tuple, Array]:
        vector, here, _ = now
        key, first = one
        key_which, key_power, key_kind, key_size, key_micro, key_accept = jax.random.split(key, 6)
        which = surrogate(jax.random.bernoulli(key_which, second).astype(int))
        power = jax.random.choice(key_power, jnp.array(powers))
        sort = jnp.where(first, 0, 1 + jax.random.choice(key_kind, 4, p=jnp.array(sorts)))
        sequence = jnp.stack([look, walk, alone, still, near])[sort]
        uniform = jax.random.uniform(key_size, (len(walk),))
        leap = longest * jnp.where(sort == 4, nearest**uniform, uniform)

        def micro(place: _Place[T], one: tuple[Array, Array, Array]) -> tuple[_Place[T], Array]:
            key, kind, leap = one
            branches = (
                lambda: place,
                lambda: _noise_moved(key, place, which, smooth, directions, power, kind == _LOOK),
                lambda: _swung(key, place, which, smooth, power, leaps, leap),
            )
            # A look is a move of no length: the surrogate is compiled in one place only.
            place = jax.lax.switch((kind + 1) // 2, branches)
            return place, place.log_density

        nothing = jax.tree.map(
            lambda x: jnp.zeros(x.shape, x.dtype), jax.eval_shape(which.under, vector)
        )
        begun = _Place(vector, nothing, jnp.zeros(()))
        keys = jax.random.split(key_micro, len(walk))
        further, seen = jax.lax.scan(micro, begun, (keys, sequence, leap))
        there, there_extra = log_density(further.vector)
        rise = (there - further.log_density) - (here - seen[0])
        chance = jnp.exp(jnp.minimum(0.0, jnp.where(jnp.isnan(rise), -jnp.inf, rise)))
        accepted = first | (jax.random.uniform(key_accept) < chance)
        proposal = further.vector, there, there_extra
        return _either(accepted, proposal, now), jnp.where(first, 0.0, chance)

    # The first step is a look at the present point: the density is compiled in one place only.
    here, extra = jax.tree.map(
        lambda one: jnp.zeros(one.shape, one.dtype), jax.eval_shape(log_density, vector)
    )
    keys, looks = jax.random.split(key, steps + 1), jnp.arange(steps + 1) == 0
    (vector, here, extra), chances = jax.lax.scan(step, (vector, here, extra), (keys, looks))
    return Swept(vector, here, extra, jnp.sum(chances) / steps)


def _noise_moved[T](
    key: Array,
    place: _Place[T],
    surrogate: Surrogate[T],
    smooth: Int[Array, " m"],
    directions: Float[Array, "k n"],
    power: Array,
    is_look: Array,
) -> _Place[T]:
    """After a Metropolis step of the noise, or after a look at the place."""
    key_which, key_size, key_way, key_accept = jax.random.split(key, 4)
    direction = jax.random.choice(key_which, directions)
    size = 10.0 ** -jax.random.uniform(key_size) * jax.random.normal(key_way)
    moved = place.vector + jnp.where(is_look, 0.0, size) * direction
    under = surrogate.under(moved)
    before, after = place.under[1], under[1]
    u = before.inverse_root @ (place.vector[smooth] - before.centre)
    carried = jnp.where(is_look, moved[smooth], after.centre + after.root @ u)
    moved = moved.at[smooth].set(carried)
    there = _Place(moved, under, surrogate.log_density(under[0], moved, power))
    rise = there.log_density + after.log_volume - place.log_density - before.log_volume
    accepted = (jnp.log(jax.random.uniform(key_accept)) < rise) | is_look
    return _either(accepted, there, place)


def _swung[T](
    key: Array,
    place: _Place[T],
    surrogate: Surrogate[T],
    smooth: Int[Array, " m"],
    power: Array,
    leaps: int,
    leap: Array,
) -> _Place[T]:
    """After a Hamiltonian trajectory of the smooth entries."""
    key_momentum, key_accept = jax.random.split(key)
    said, rough = place.under

    def vector_at(w: Array) -> Array:
        return place.vector.at[smooth].set(rough.root @ w)

    @jax.value_and_grad
    def log_density(w: Array) -> Array:
        return surrogate.log_density(said, vector_at(w), power)

    w = rough.inverse_root @ place.vector[smooth]
    momentum = jax.random.normal(key_momentum, w.shape)

    def leapt(now: tuple, _: None) -> tuple[tuple, None]:
        w, momentum, _, slope = now
        momentum += 0.5 * leap * slope
        w += leap * momentum
        value, slope = log_density(w)
        return (w, momentum + 0.5 * leap * slope, value, slope), None

    begun = w, momentum, *log_density(w)
    (w, ended, value, _), _ = jax.lax.scan(leapt, begun, length=leaps)
    rise = value - place.log_density + 0.5 * (momentum @ momentum - ended @ ended)
    accepted = jnp.log(jax.random.uniform(key_accept)) < rise
    return _either(accepted, place._replace(vector=vector_at(w), log_density=value), place)


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
    """Of which both surrogates are made, stacked; to be set before the first draw."""
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
        surrogate: from the state's `about` and the data.
        smooth: places of the smooth entries.
        directions, steps, moves: as in `sweep`.
        slices: of the noise, from key, values, prediction and data.
    """

    sample_field = "z"

    def __init__(
        self,
        model: CalibrationModel,
        surrogate: Callable[..., Surrogate[Any]],
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
            lambda which: self._surrogate(jax.tree.map(lambda x: x[which], state.about), data),
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
