"""Steps that a surrogate proposes, against moments that are known; both samplers of a posterior."""

import arviz as az
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro import distributions as dist

import muscle_bayes as mb
from muscle_bayes.inference.sampling.fit import fit
from muscle_bayes.inference.sampling.kernels import LinearisedSteps, Nuts
from muscle_bayes.inference.sampling.sampler import Effort
from muscle_bayes.inference.sampling.surrogate_transitions import Surrogate, sweep

SMOOTH = np.array([0, 2])


def log_density(vector: jax.Array) -> tuple[jax.Array, jax.Array]:
    """A funnel with heavy tails: noise n ~ N(0, 1) at place 1, x ~ t_8(1 + n / 2, exp(n / 2))."""
    noise, x = vector[1], vector[SMOOTH]
    conditional = dist.StudentT(8.0, 1.0 + 0.5 * noise, jnp.exp(0.5 * noise))
    return dist.Normal(0.0, 1.0).log_prob(noise) + conditional.log_prob(x).sum(), x.sum()


def surrogate(vector: jax.Array, off: float, width: float) -> Surrogate:
    """A normal with the funnel's shape, more or less."""
    noise = vector[1]
    scale = width * jnp.exp(0.4 * noise)
    mixing = jnp.array([[1.0, 0.0], [0.3, 1.0]])
    root = scale * mixing
    return Surrogate(
        -0.5 * ((noise - off) / (1.0 + abs(off))) ** 2,
        (1.0 + off + 0.4 * noise) * jnp.ones(2),
        root,
        jnp.linalg.inv(root),
        2.0 * jnp.log(scale),
    )


@pytest.mark.parametrize(("off", "width"), [(0.0, 1.1), (0.5, 0.8), (-0.4, 1.6)])
def test_moments_are_those_of_the_density_however_good_the_surrogate(off, width) -> None:
    directions = jnp.array([[0.0, 2.0, 0.0]])

    @jax.jit
    def run(key: jax.Array) -> tuple[jax.Array, jax.Array]:
        def step(vector: jax.Array, key: jax.Array) -> tuple:
            found = sweep(
                key,
                vector,
                log_density,
                lambda v: surrogate(v, off, width),
                SMOOTH,
                directions,
                steps=2,
                moves=2,
            )
            return found.vector, (found.vector, found.extra)

        return jax.lax.scan(step, jnp.ones(3), jax.random.split(key, 20_000))[1]

    drawn, extra = map(np.asarray, run(jax.random.key(0)))
    np.testing.assert_allclose(extra, drawn[:, SMOOTH].sum(1))
    assert not np.array_equal(drawn[0], drawn[-1])
    noise, x = drawn[:, 1], drawn[:, 2]
    variance_of_x = 8.0 / 6.0 * np.exp(0.5) + 0.25  # E exp(n), and the variance of the mean
    known = ((noise, 0.0, 1.0), (x, 1.0, variance_of_x), (noise * (x - 1.0), 0.5, None))
    for values, mean, variance in known:
        moments = [(values, mean)] + [((values - mean) ** 2, variance)] * (variance is not None)
        for moment, wanted in moments:
            ess = float(az.ess(moment[None], method="mean"))
            assert ess > 150
            assert abs(moment.mean() - wanted) < 4.0 * moment.std() / np.sqrt(ess)


@pytest.mark.slow
def test_one_posterior_by_either_sampler() -> None:
    runs = mb.load_example("springs")[:2]
    effort = {"warmup": 50, "draws": 150, "rounds": 0}
    quick = fit(runs, effort=Effort(**effort, sampler=LinearisedSteps()))
    careful = fit(runs, effort=Effort(**effort, sampler=Nuts()))
    assert "diverging" not in quick.tree["sample_stats"]
    assert "diverging" in careful.tree["sample_stats"]
    assert float(quick.tree["sample_stats"]["acceptance_rate"].mean()) > 0.3
    assert Nuts().statistics.keys() >= {"diverging", "step_size"}
    for name in ("J", "D"):
        ours, theirs = (one.tree["posterior"][name].to_numpy() for one in (quick, careful))
        assert abs(ours.mean() - theirs.mean()) < 0.4 * theirs.std(), name
        assert 0.7 < ours.std() / theirs.std() < 1.4, name
