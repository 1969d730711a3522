"""When chains count as agreeing."""

import numpy as np

from muscle_bayes.inference.sampling.sampler import Draws, Effort, agree


def drawn(shift: float, count: int) -> Draws:
    random = np.random.default_rng(2)
    vector = random.normal(size=(4, count, 2)) + shift * np.arange(4)[:, None, None]
    return Draws(vector, vector, {"acceptance_rate": np.ones((4, count))})


def test_chains_agree_only_where_they_are_alike_and_long_enough():
    assert agree(drawn(0.0, 1000), Effort())
    assert not agree(drawn(0.0, 80), Effort())
    assert not agree(drawn(0.3, 1000), Effort())
    assert agree(drawn(0.1, 1000), Effort(max_rhat=1.05))
    assert not agree(drawn(0.3, 1000), Effort(max_rhat=1.05))
