"""The sampler's bent coordinates: an exact change of variables."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.inference.bend import Bend, bent, unbent
from muscle_bayes.inference.bend_friction import FrictionScale
from muscle_bayes.inference.density import unconstrain
from muscle_bayes.inference.problem import Problem, pose

BEND = Bend(FrictionScale(np.float64(3e-3), np.float64(1.0)), np.float64(1.0))
DATA = Path(__file__).parents[2] / "data"


@pytest.fixture(scope="module")
def staircases() -> Problem:
    with jax.enable_x64(True):
        runs = read_runs([DATA])
        return pose([run for run in runs if run.metadata.protocol == "staircase"])


def draw(problem: Problem, seed: int):
    keys = jax.random.split(jax.random.key(seed), len(problem.layout.shapes))
    values = {
        name: problem.data.priors[name].sample(key)
        for key, (name, _) in zip(keys, problem.layout.shapes, strict=True)
    }
    return unconstrain(values, problem.layout, problem.data)


@pytest.mark.parametrize("seed", range(5))
def test_bending_is_undone_and_its_volume_is_that_of_the_jacobian(staircases, seed):
    layout, data = staircases.layout, staircases.data
    vector = draw(staircases, seed)
    there = bent(vector, BEND, layout, data)
    back = unbent(there, BEND, layout, data)
    np.testing.assert_allclose(back.vector, vector, rtol=1e-9, atol=1e-9)
    jacobian = jax.jacfwd(lambda b: unbent(b, BEND, layout, data).vector)(there)
    sign, log_volume = np.linalg.slogdet(jacobian)
    assert sign == 1.0
    np.testing.assert_allclose(back.log_volume, log_volume, rtol=1e-9, atol=1e-9)


def test_the_ridge_of_a_slow_hyst_is_straight(staircases):
    """Creep and first strain held, the time constant alone moves: the record cannot tell."""
    layout, data = staircases.layout, staircases.data
    there = bent(draw(staircases, 1), BEND, layout, data)
    start = int(
        np.cumsum([0, *(int(np.prod(s)) for _, s in layout.shapes)])[
            [name for name, _ in layout.shapes].index("time_constant")
        ]
    )
    names = np.repeat([n for n, _ in layout.shapes], [int(np.prod(s)) for _, s in layout.shapes])
    seen = []
    for log_time in (12.0, 13.0):
        vector = unbent(there.at[start].set(log_time), BEND, layout, data).vector
        stretch = vector[np.flatnonzero(names == "slow.hyst_stretch")]
        seen.append((vector[np.flatnonzero(names == "taut_strain")] + stretch.mean(), stretch))
    np.testing.assert_allclose(seen[0][0], seen[1][0], rtol=1e-9)
    # Much slower than the record, creep goes as stretch / time constant.
    np.testing.assert_allclose(seen[1][1] / seen[0][1], np.exp(1.0), rtol=0.01)
    assert jnp.isfinite(seen[1][1]).all()
