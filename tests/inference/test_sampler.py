"""When chains count as agreeing, when sampling ends, and what is sliced."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from table_2 import sampled

import muscle_bayes as mb
from muscle_bayes.inference.model.calibration_model import calibration_model
from muscle_bayes.inference.model.density import unconstrain
from muscle_bayes.inference.running.programs import potential_at
from muscle_bayes.inference.sampling.draws import Draws
from muscle_bayes.inference.sampling.linearised import expected_at
from muscle_bayes.inference.sampling.sampler import (
    Effort,
    agree,
    first_to_mix,
    out_of_reach,
    walls_at,
)
from muscle_bayes.inference.search.mode import Mode


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


def wandering(step: float, count: int) -> Draws:
    """Chains that walk at random, each step so large, from places that are unit apart."""
    random = np.random.default_rng(3)
    walks = np.cumsum(step * random.normal(size=(4, count, 1)), axis=1)
    vector = walks + np.arange(4)[:, None, None]
    return Draws(vector, vector, {"acceptance_rate": np.ones((4, count))})


def test_sampling_ends_where_no_allowance_would_do():
    effort = Effort(draws=100, rounds=24, min_ess=200)
    assert out_of_reach(wandering(0.005, 400), effort)
    assert not out_of_reach(wandering(0.005, 100), effort), "too few draws to tell"
    assert not out_of_reach(drawn(0.1, 400), effort), "chains that nearly agree go on"
    assert not out_of_reach(wandering(0.005, 400), replace(effort, rounds=600))


@pytest.mark.parametrize(("force", "told"), [(0.5, False), (5.5, True)])
def test_a_force_at_which_a_spring_opens_within_the_records_is_no_wall(
    force: float, told: bool
) -> None:
    """The tension begins at 4 N: a minimum force below changes nothing, one above readings tell well."""
    problem = calibration_model([mb.load_example("staircase-139g")[0].until(150.0)]).problem
    values = sampled(problem) | {"F_modulus_min": jnp.asarray(force)}
    vector = unconstrain(values, problem.layout, problem.data)
    (readings,) = expected_at(vector, problem.layout, problem.data)
    (lanes,) = problem.data.lanes
    seen = replace(problem, data=problem.data._replace(lanes=(lanes._replace(reading=readings),)))
    mode = Mode(vector, potential_at(vector, seen.layout, seen.data), np.eye(len(vector)), 0)
    assert walls_at(mode, seen) == (() if told else ("F_modulus_min",)) + ("F_hyst_min",)
