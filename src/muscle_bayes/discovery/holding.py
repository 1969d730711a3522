"""Readings that a fit must not see: data of the same shape, in which they do not count."""

from collections.abc import Collection
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from muscle_bayes.inference.model.problem import Problem
from muscle_bayes.inference.posteriors.starts import SETTLING_SHARE
from muscle_bayes.inference.search.nested import Nested


def without_runs(problem: Problem, names: Collection[str]) -> Problem:
    """The problem with only the first SETTLING_SHARE of these runs, which tells their own starts."""
    if not names:
        return problem
    lanes = []
    for group, owners in zip(problem.data.lanes, problem.lane_runs, strict=True):
        runs = [problem.runs[owner] for owner in owners]
        ends = [SETTLING_SHARE * r.duration if r.name in names else np.inf for r in runs]
        seen = group.time <= jnp.asarray(ends)[:, None]
        lanes.append(group._replace(weight=jnp.where(seen, group.weight, 0.0)))
    return replace(problem, data=problem.data._replace(lanes=tuple(lanes)))


def without_blocks(
    nested: Nested, blocks: Float[np.ndarray, " error"], chosen: Collection[int]
) -> Nested:
    """The model on data without these blocks of readings."""
    lanes, start = [], 0
    for group in nested.data.lanes:
        own = blocks[start : start + group.weight.size].reshape(group.weight.shape)
        start += group.weight.size
        hidden = jnp.asarray(np.isin(own, list(chosen)))
        lanes.append(group._replace(weight=jnp.where(hidden, 0.0, group.weight)))
    problem = nested.problem
    return nested.on(replace(problem, data=problem.data._replace(lanes=tuple(lanes))))
