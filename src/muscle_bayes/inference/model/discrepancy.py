"""What readings show besides the model: a distribution with a slow discrepancy and white noise."""

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float
from numpyro import distributions as dist
from numpyro.distributions import constraints
from numpyro.distributions.util import validate_sample

from muscle_bayes.inference.model.noise import NoiseParameters, whiten

LOG_2PI = math.log(2.0 * math.pi)


class OUDiscrepancy(dist.Distribution):
    """Readings about a model's prediction: Ornstein-Uhlenbeck discrepancy plus white noise.

        reading_k = prediction_k + basis_k a + d(s_k) + e_k,      a ~ N(0, I),  e_k ~ N(0, white_variance_k)
        cov(d(s), d(s')) = discrepancy^2 exp(-|s - s'| / correlation_time)

    The density is that of the one-step-ahead errors of a Kalman filter; `a` is integrated out by the
    matrix inversion lemma. Source: Kennedy and O'Hagan, J. R. Stat. Soc. B 63 (2001), for the
    discrepancy; Uhlenbeck and Ornstein, Phys. Rev. 36 (1930), for the process.

    Args:
        prediction: of the model [the log's unit], shape (n,).
        elapsed: by how much the discrepancy's clock s advances up to each reading [s].
        white_variance: of the white noise and the quantisation of each reading [unit^2].
        observed: 1 where a reading was taken, 0 where not (padding).
        noise: `discrepancy` [unit] and `correlation_time` [s].
        added: variance that enters the discrepancy besides, by jumps of the load say [unit^2].
        basis: sensitivity of the readings to unknown starts, shape (n, k), or None.

    Example:
        >>> noise = NoiseParameters(noise=0.1, discrepancy=0.5, correlation_time=2.0)
        >>> n = jnp.ones(3)
        >>> OUDiscrepancy(0 * n, n, 0.01 * n, n, noise).log_prob(jnp.array([0.1, 0.2, 0.1])).shape
        ()
    """

    support = constraints.real_vector
    reparametrized_params = ("prediction",)
    pytree_data_fields = (
        "prediction",
        "elapsed",
        "white_variance",
        "observed",
        "noise",
        "added",
        "basis",
    )

    def __init__(
        self,
        prediction: Float[Array, " n"],
        elapsed: Float[Array, " n"],
        white_variance: Float[Array, " n"],
        observed: Float[Array, " n"],
        noise: NoiseParameters,
        added: Float[Array, " n"] | None = None,
        basis: Float[Array, "n k"] | None = None,
        *,
        validate_args: bool | None = None,
    ) -> None:
        self.prediction, self.elapsed = prediction, elapsed
        self.white_variance, self.observed = white_variance, observed
        self.noise, self.basis = noise, basis
        self.added = jnp.zeros_like(prediction) if added is None else added
        super().__init__(
            batch_shape=jnp.shape(prediction)[:-1],
            event_shape=jnp.shape(prediction)[-1:],
            validate_args=validate_args,
        )

    def sample(self, key: Array, sample_shape: tuple[int, ...] = ()) -> Array:
        """Readings as they would be logged, without rounding; numbers also where nothing is observed."""
        key_first, key_slow, key_white, key_start = jax.random.split(key, 4)
        shape = (*sample_shape, *self.batch_shape, *self.event_shape)
        kicks = jax.random.normal(key_slow, shape)
        fade = jnp.exp(-self.elapsed / self.noise.correlation_time)
        size = self.noise.discrepancy

        def step(state: Array, now: tuple[Array, Array, Array]) -> tuple[Array, Array]:
            decay, kick, added = now
            state = decay * state + jnp.sqrt((1.0 - decay**2) * size**2 + added) * kick
            return state, state

        spread = jnp.broadcast_to(fade, shape), kicks, jnp.broadcast_to(self.added, shape)
        first = jax.random.normal(key_first, shape[:-1]) * size
        _, slow = jax.lax.scan(step, first, tuple(jnp.moveaxis(x, -1, 0) for x in spread))
        white = jnp.sqrt(self.white_variance) * jax.random.normal(key_white, shape)
        reading = self.prediction + jnp.moveaxis(slow, 0, -1) + white
        if self.basis is not None:
            starts = jax.random.normal(key_start, (*shape[:-1], self.basis.shape[-1]))
            reading = reading + jnp.einsum("...nk,...k->...n", self.basis, starts)
        return reading

    def of(self, chosen: Any) -> "OUDiscrepancy":
        """The distribution of some of the records along the leading axis."""
        return OUDiscrepancy(
            self.prediction[chosen],
            self.elapsed[chosen],
            self.white_variance[chosen],
            self.observed[chosen],
            self.noise,
            self.added[chosen],
            None if self.basis is None else self.basis[chosen],
            validate_args=False,
        )

    @validate_sample
    def log_prob(self, value: Float[Array, "... n"]) -> Float[Array, "..."]:
        """Log density of the readings; those that are not observed do not count."""
        return self.log_densities(value).sum(-1)

    def log_densities(self, value: Float[Array, "... n"]) -> Float[Array, "... n"]:
        """Log density of each reading given the earlier ones; 0 where nothing is observed."""
        return self.innovations(value).log_density

    def innovations(self, value: Float[Array, "... n"]) -> "Innovations":
        """One-step-ahead errors of the readings, and their log density."""
        one = _innovations
        for _ in self.batch_shape:
            one = jax.vmap(one, in_axes=(0, 0, None))
        residual = value - self.prediction
        for _ in range(residual.ndim - self.prediction.ndim):
            one = jax.vmap(one, in_axes=(0, None, None))
        return one(residual, self._record, self.noise)

    def sensitivities(self, changes: Float[Array, "... n m"]) -> Float[Array, "... n m"]:
        """Change of the errors of `innovations` with changes of the prediction, the clock as it is."""
        one = _sensitivities
        for _ in self.batch_shape:
            one = jax.vmap(one, in_axes=(0, 0, None))
        return one(changes, self._record, self.noise)

    @property
    def _record(self) -> "_Record":
        parts = self.elapsed, self.white_variance, self.added, self.observed
        return _Record(*parts, self.basis)


class _Record(NamedTuple):
    """When a record's readings were taken, and how well; arguments of `OUDiscrepancy`."""

    elapsed: Float[Array, "... n"]
    white_variance: Float[Array, "... n"]
    added: Float[Array, "... n"]
    observed: Float[Array, "... n"]
    basis: Float[Array, "... n k"] | None


class Innovations(NamedTuple):
    """What each reading adds to what the earlier ones said; 0 where nothing is observed."""

    log_density: Float[Array, "... n"]
    errors: Float[Array, "... n"]
    """Standardised one-step-ahead errors, what unknown starts explain taken out."""
    log_scale: Float[Array, "... n"]
    """Log of the standard deviation by which they are standardised."""


def _whitened(columns: Array, record: _Record, noise: NoiseParameters) -> tuple[Array, Array]:
    """Whitened columns, those of the basis last, and the log scale of each reading."""
    basis = record.basis
    if basis is not None:
        columns = jnp.concatenate([columns, jnp.where(jnp.isfinite(basis), basis, 0.0)], axis=1)
    return whiten(columns, *record[:4], noise)


def _innovations(
    residual: Float[Array, " n"], record: _Record, noise: NoiseParameters
) -> Innovations:
    """Of one record. Starts a ~ N(0, I): log N(z; 0, I + S S') with z, S the whitened columns."""
    finite = jnp.where(jnp.isfinite(residual), residual, 0.0)
    errors, log_scale = _whitened(finite[:, None], record, noise)
    z, s, observed = errors[:, 0], errors[:, 1:], record.observed
    density = -0.5 * z**2 - log_scale - 0.5 * LOG_2PI * observed
    if record.basis is not None:
        information, explained = _explained(z, s)
        volume = 0.5 * jnp.linalg.slogdet(information)[1]
        density += 0.5 * explained * z - volume * observed / jnp.maximum(observed.sum(), 1.0)
        z = z - explained
    return Innovations(density, z, log_scale)


def _sensitivities(
    changes: Float[Array, "n m"], record: _Record, noise: NoiseParameters
) -> Float[Array, "n m"]:
    """Of the errors of one record to its prediction."""
    errors, _ = _whitened(-changes, record, noise)
    z, s = errors[:, : changes.shape[1]], errors[:, changes.shape[1] :]
    return z if record.basis is None else z - _explained(z, s)[1]


def _explained(z: Array, s: Float[Array, "n k"]) -> tuple[Float[Array, "k k"], Array]:
    """I + S'S, and what unknown starts explain of whitened columns: S (I + S'S)^-1 S'z."""
    information = jnp.eye(s.shape[1]) + s.T @ s
    return information, s @ jnp.linalg.solve(information, s.T @ z)
