"""Priors pass through compiled programs, and these are the same ones in every process."""

import os
import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from numpyro import distributions as dist
from numpyro.distributions import biject_to

from muscle_bayes.inference.model.priors import Priors

DATA = Path(__file__).parents[2] / "data" / "plain"
GIVEN = {
    "J": dist.LogNormal(jnp.asarray(-6.0), 2.0),
    "softening": dist.Beta(2.0, 3.0),
    "zero": dist.Normal(jnp.array([510.0, 513.0]), 2.0),
    "size": dist.HalfNormal(0.3),
    "speed": dist.TruncatedNormal(0.5, 0.2, low=0.05, high=2.0),
}
LOWERED = """
import hashlib, sys
import jax
from muscle_bayes.data import read_runs
from muscle_bayes.inference.model.density import potential
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.nested_programs import explained_at

with jax.enable_x64(True):
    runs = read_runs(sys.argv[1:])
    problem = pose(runs)
    size = sum(1 if not shape else shape[0] for _, shape in problem.layout.shapes)
    lowered = [
        jax.jit(potential, static_argnums=1).lower(
            jax.ShapeDtypeStruct((size,), "float64"), problem.layout, problem.data
        )
    ]
    model = Nested(pose(runs, "coulomb", ["viscous-friction"]), {"fast": 0.1, "slow": 0.1})
    point = jax.ShapeDtypeStruct((model.shared + model.slots,), "float64")
    program = jax.jit(explained_at, static_argnums=2)
    lowered.append(program.lower(point, model.choice(()), model.layout, model.data))
    text = "".join(one.as_text() for one in lowered)
    print(hashlib.sha256(text.encode()).hexdigest())
"""


def test_they_are_the_distributions_given() -> None:
    passed = jax.jit(lambda priors: priors)(Priors(GIVEN))
    assert list(passed) == list(GIVEN)
    for name, prior in GIVEN.items():
        assert type(passed[name]) is type(prior)
        assert passed[name].shape() == prior.shape()
        at = prior.sample(jax.random.key(1))
        np.testing.assert_allclose(passed[name].log_prob(at), prior.log_prob(at), rtol=1e-6)
        free = (biject_to(one.support)(0.3) for one in (passed[name], prior))
        np.testing.assert_allclose(*free, rtol=1e-6)


def test_priors_of_a_family_are_its_entries_of_the_vector() -> None:
    given = {"first": dist.Normal(1.0, 2.0), **GIVEN, "last": dist.LogNormal(0.5, 0.1)}
    shapes = [(name, prior.shape()) for name, prior in given.items()]
    sizes = [int(np.prod(shape)) for _, shape in shapes]
    at = np.linspace(0.1, 0.9, sum(sizes))
    one_by_one = [
        np.broadcast_to(prior.log_prob(part.reshape(prior.shape())), prior.shape()).ravel()
        for prior, part in zip(given.values(), np.split(at, np.cumsum(sizes)[:-1]), strict=True)
    ]
    together = np.full(at.size, np.nan)
    groups = Priors(given).by_family(shapes)
    assert len(groups) == 5
    for prior, entries in groups:
        together[entries] = prior.log_prob(at[entries])
    np.testing.assert_allclose(together, np.concatenate(one_by_one), rtol=1e-6)


def test_programs_do_not_depend_on_the_process() -> None:
    """Else nothing that an earlier process compiled would be found again."""
    found = set()
    for seed in ("1", "2"):
        runs = [str(DATA / f"{name}.csv") for name in ("spring-1", "staircase-139g")]
        command = [sys.executable, "-c", LOWERED, *runs]
        environment = os.environ | {"PYTHONHASHSEED": seed}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        found.add(done.stdout.strip())
    assert len(found) == 1
