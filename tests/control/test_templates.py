"""Boxes of gains: what the board holds, and what counts as an edge."""

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


def test_no_bias_and_no_back_calculation_are_no_edges(joints):
    made = template("two-degrees", joints)
    names = list(made.box)
    place = made.place(made.at([0.5] * len(names)))
    assert made.edges(place) == []
    place[names.index("bias")], place[names.index("windup_time")] = 0.0, 1.0
    assert made.edges(place) == []
    place[names.index("proportional")], place[names.index("filter_time")] = 1.0, 0.0
    assert made.edges(place) == ["proportional", "filter_time"]
