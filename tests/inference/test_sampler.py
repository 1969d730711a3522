"""When chains count as agreeing."""

import numpy as np

from muscle_bayes.inference.sampling.draws import Draws
from muscle_bayes.inference.sampling.sampler import Effort, agree, first_to_mix


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


class Pretended:
    """Chains that draw what they are given."""

    def __init__(self, shift: float) -> None:
        self.shift, self.warmed = shift, False

    def warm_up(self, count: int) -> None:
        self.warmed = True

    def go_on(self, count: int) -> Draws:
        return drawn(self.shift, count)


def test_a_sampler_whose_chains_stay_far_apart_gives_way_to_the_next():
    """Up to the first whose chains come near each other; where none do, the nearest go on."""
    far, near, unused = Pretended(2.0), Pretended(0.1), Pretended(0.0)
    assert first_to_mix([far, near, unused], Effort())[1] is near
    assert far.warmed
    assert near.warmed
    assert not unused.warmed
    nearest = Pretended(1.0)
    assert first_to_mix([far, nearest, Pretended(3.0)], Effort())[1] is nearest


def test_chains_that_diverge_give_way_to_those_that_are_far_apart():
    diverging = Pretended(0.0)
    diverging.go_on = lambda count: drawn(0.0, count)._replace(
        statistics={"diverging": np.arange(4 * count).reshape(4, count) % 10 == 0}
    )
    far = Pretended(2.0)
    assert first_to_mix([far, diverging], Effort())[1] is far


def test_chains_that_never_move_are_infinitely_far_apart():
    still = Pretended(0.0)
    still.go_on = lambda count: Draws(np.ones((4, count, 1)), np.ones((4, count, 1)), {})
    near = Pretended(0.1)
    assert first_to_mix([still, near], Effort())[1] is near
