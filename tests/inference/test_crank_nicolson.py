"""Crank-Nicolson steps, against moments that are known and against NUTS."""

import arviz as az
import jax
import jax.numpy as jnp
import numpy as np
import numpyro
import pytest
from numpyro import distributions as dist
from numpyro.infer import MCMC, CustomGibbs, Gibbs

import muscle_bayes as mb
from muscle_bayes.inference.sampling.crank_nicolson import CrankNicolson
from muscle_bayes.inference.sampling.fit import fit
from muscle_bayes.inference.sampling.kernels import CrankNicolsonSteps, Nuts
from muscle_bayes.inference.sampling.sampler import Effort


def model(shift: float) -> None:
    numpyro.sample("rate", dist.Gamma(4.0, 2.0))
    place = numpyro.sample("place", dist.StudentT(8.0, shift, 0.5).expand([2]).to_event(1))
    numpyro.sample("other", dist.Normal(place[0], 1.0))


def drawn(centre: jax.Array, root: jax.Array, count: int = 8000) -> dict[str, np.ndarray]:
    """Draws with an approximation of (place, log rate), the order of names."""

    def other(*, rng_key, gibbs_sites, hmc_sites):
        return {"other": hmc_sites["place"][0] + jax.random.normal(rng_key)}

    block = CrankNicolson(model, 4)
    kernel = Gibbs([(CustomGibbs(other), ["other"]), (block, ["place", "rate"])])
    state = kernel.init(jax.random.key(0), 0, None, (1.5,), {})
    begun = state.block_states[1]._replace(centre=centre, root=root)
    chains = MCMC(kernel, num_warmup=0, num_samples=count, progress_bar=False)
    chains.post_warmup_state = state._replace(block_states=(state.block_states[0], begun))
    chains.run(jax.random.key(1), 1.5)
    return {name: np.asarray(value) for name, value in chains.get_samples().items()}


@pytest.mark.parametrize(("off", "width"), [(0.0, 0.7), (0.6, 0.5), (-0.3, 1.5)])
def test_moments_are_those_of_the_density_however_good_the_approximation(off, width) -> None:
    centre = jnp.array([1.5, 1.5, np.log(2.0)]) + off
    found = drawn(centre, width * jnp.eye(3))
    known = {
        "rate": (found["rate"], 2.0, 1.0),
        "place": (found["place"][:, 1], 1.5, 0.25 * 8.0 / 6.0),
        "other": (found["other"], 1.5, 1.0 + 0.25 * 8.0 / 6.0),
    }
    for name, (values, mean, variance) in known.items():
        for moment, wanted in ((values, mean), ((values - mean) ** 2, variance)):
            ess = float(az.ess(moment[None], method="mean"))
            error = moment.std() / np.sqrt(ess)
            assert ess > 150, name
            assert abs(moment.mean() - wanted) < 4.0 * error, (name, moment.mean(), wanted)


def test_one_posterior_by_either_kernel() -> None:
    """And chains that accept too little go on with NUTS, which tells of divergences."""
    runs = mb.load_example("springs")[:2]
    effort = {"warmup": 50, "draws": 150, "rounds": 0}
    quick = fit(runs, effort=Effort(**effort, smooth=CrankNicolsonSteps()))
    careful = fit(runs, effort=Effort(**effort, least_acceptance=1.1))
    assert "diverging" not in quick.tree["sample_stats"]
    assert "diverging" in careful.tree["sample_stats"]
    assert Nuts().statistics.keys() >= {"diverging", "step_size"}
    for name in ("J", "D"):
        ours, theirs = (one.tree["posterior"][name].to_numpy() for one in (quick, careful))
        assert abs(ours.mean() - theirs.mean()) < 0.4 * theirs.std(), name
        assert 0.7 < ours.std() / theirs.std() < 1.4, name
