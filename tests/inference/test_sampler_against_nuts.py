"""The sampler against NumPyro's NUTS on the same density."""

from pathlib import Path

import arviz as az
import jax
import numpy as np
import pytest
from numpyro.infer import MCMC, NUTS

from muscle_bayes.data import read_runs
from muscle_bayes.inference.model.density import potential
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.sampling.fit import sample
from muscle_bayes.inference.sampling.gibbs_blocks import blocks_of
from muscle_bayes.inference.sampling.sampler import Effort
from muscle_bayes.inference.search.mode import find_mode
from muscle_bayes.inference.search.tempering import entry_names

DATA = Path(__file__).parents[2] / "data" / "plain"


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_both_draw_from_one_posterior() -> None:
    # Short discrepancy stands for noise in a long, thin tail, which NUTS hardly enters: the noise's
    # moves are held against the prior instead (test_gibbs_blocks.py).
    problem = pose(read_runs([DATA / "spring-1.csv", DATA / "spring-3.csv"]))
    layout, data = problem.layout, problem.data
    ours = sample(problem, Effort(warmup=150, draws=600, min_ess=400), seed=1).draws.vector
    start = find_mode(jax.random.key(0), layout, data).vector
    kernel = NUTS(
        potential_fn=jax.jit(lambda vector: potential(vector, layout, data)),
        dense_mass=True,
        target_accept_prob=0.9,
    )
    chains = MCMC(kernel, num_warmup=600, num_samples=1500, progress_bar=False)
    chains.run(jax.random.key(2), init_params=start)
    theirs = np.asarray(chains.get_samples(group_by_chain=True))
    names = entry_names(layout)
    smooth = np.flatnonzero(np.isin(names, blocks_of(list(dict.fromkeys(names))).smooth))
    ours, theirs = ours[..., smooth], theirs[..., smooth]
    found = [az.convert_to_datatree({"v": draws}).posterior for draws in (ours, theirs)]
    mean, spread, ess = (
        [np.asarray(of(one)) for one in found]
        for of in (
            lambda one: one["v"].mean(("chain", "draw")),
            lambda one: one["v"].std(("chain", "draw")),
            lambda one: az.ess(one)["v"],
        )
    )
    assert min(ess[0].min(), ess[1].min()) > 100
    error = np.sqrt(sum(s**2 / n for s, n in zip(spread, ess, strict=True)))
    away = (mean[0] - mean[1]) / error
    assert np.abs(away).max() < 4.5, away
    # The relative error of a standard deviation is 1 / sqrt(2 ESS) for a normal, more with tails.
    loose = np.sqrt(sum(1.0 / n for n in ess))
    assert (np.abs(np.log(spread[0] / spread[1])) < 4.5 * loose).all(), spread[0] / spread[1]
