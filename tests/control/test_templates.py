"""Boxes of gains: what the board holds, and what counts as an edge."""

import numpy as np
import pytest

from muscle_bayes.control.laws.gains import fits_the_board
from muscle_bayes.control.laws.templates import TUNED, template

BENCH_COUNT = 0.0058
"""rad"""


@pytest.mark.parametrize("law", TUNED)
@pytest.mark.parametrize("period_ms", [10, 30, 300, 1000])
def test_the_board_holds_every_corner_of_the_box(law, period_ms, joints):
    made = template(law, joints, period_ms)
    for place in (0.0, 1.0):
        assert fits_the_board(made.at([place] * len(made.box)), joints.design)


def test_the_largest_proportional_gain_asks_for_full_duty_for_one_count(joints):
    """More would change nothing but what happens within the potentiometer's resolution."""
    made = template("pi", joints)
    assert made.box["proportional"][1] * BENCH_COUNT == pytest.approx(255.0, rel=1e-2)


def test_an_edge_that_is_physical_says_what_it_means(joints):
    made = template("two-degrees", joints)
    names = list(made.box)
    place = made.place(made.at([0.5] * len(names)))
    assert made.edges(place) == []
    place[names.index("bias")] = 0.0
    assert made.edges(place) == []
    for name, x in (("proportional", 1.0), ("windup_time", 1.0), ("filter_time", 0.0)):
        place[names.index(name)] = x
    assert made.edges(place) == [
        "proportional (full duty for one count)",
        "windup_time (no back-calculation)",
        "filter_time (no filter)",
    ]
    place[names.index("integral")] = 1.0
    assert "integral" in made.edges(place)


def test_a_proportional_gain_at_the_edge_of_a_cascade_is_only_that(joints):
    made = template("cascade", joints)
    place = np.full(len(made.box), 0.5)
    place[list(made.box).index("proportional")] = 1.0
    assert made.edges(place) == ["proportional"]
