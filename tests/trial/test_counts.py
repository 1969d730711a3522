"""Counting of outcomes, on outcomes made up for it."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from benchmarks.trial.cases import RIG_NAMES, cases, write_runs
from benchmarks.trial.counts import (
    Rate,
    as_presumed,
    confusion,
    counted,
    power,
    rates,
    reliability,
)
from benchmarks.trial.other_rigs import HIDDEN, HIDDEN_OUTSIDE
from benchmarks.trial.outside import OUTSIDE
from muscle_bayes.twin import EFFECTS


def _outcome(kind: str, hidden: list[str], verdict: list[str], **more) -> dict:
    said = more.pop("said", 0.9)
    other = "none" if verdict[0] != "none" else "unknown"
    made = {
        "kind": kind,
        "rig": "other",
        "hidden": hidden,
        "verdict": verdict,
        "tie": [],
        "ports": ["torque"],
        "tied_ports": [],
        "port": "torque" if kind == "outside" else None,
        "excess": 2.0,
        "excess_left": [2.0],
        "held_out": 1.0,
        "probabilities": {"slack": 0.0, verdict[0]: said, other: 1.0 - said},
    }
    return made | more


OUTCOMES = [
    _outcome("single", ["slack"], ["slack"]),
    _outcome("single", ["slack"], ["thermal-lag"], tie=["thermal-lag", "slack"], held_out=1.5),
    _outcome("single", ["slack"], ["none"], excess=0.1),
    _outcome("none", [], ["none"], excess=0.0),
    _outcome("none", [], ["slack"], excess=0.0),
    _outcome("outside", ["detent"], ["unknown"]),
    _outcome("outside", ["tether"], ["slack"], ports=["tension"]),
    _outcome(
        "outside", ["detent"], ["unknown"], ports=["tension"], tied_ports=["tension", "torque"]
    ),
    _outcome(
        "outside",
        ["detent"],
        ["slack", "unknown"],
        probabilities={"slack": 0.1, "none": 0.0, "unknown": 0.9},
    ),
    _outcome("pair", ["slack", "thermal-lag"], ["thermal-lag", "slack"]),
    _outcome("pair", ["slack", "thermal-lag"], ["slack"], excess_left=[0.1]),
    _outcome("pair", ["slack", "thermal-lag"], ["slack"], excess_left=[0.6]),
    _outcome("pair", ["slack", "thermal-lag"], ["detent"], excess_left=[0.1]),
    _outcome("pair", ["slack", "thermal-lag"], ["none"], excess_left=[]),
]


def test_rates() -> None:
    found = {one.what: (one.hits, one.cases) for one in rates(OUTCOMES)}
    assert list(found.values()) == [
        (2, 2),
        (1, 2),
        (1, 2),
        (3, 4),
        (2, 4),
        (3, 4),
        (2, 4),
        (1, 2),
        (1, 5),
        (1, 4),
    ]


def test_intervals_are_exact() -> None:
    rate = Rate.of("", "", [True] * 17 + [False] * 3)
    exact = binomtest(17, 20).proportion_ci(0.95, "exact")
    assert (rate.low, rate.high) == pytest.approx((exact.low, exact.high))
    assert Rate.of("", "", [True] * 4).high == 1.0
    assert Rate.of("", "", [False] * 4).low == 0.0


def test_confusion_leaves_out_what_cannot_be_seen() -> None:
    assert confusion(OUTCOMES) == {
        "detent": {"unknown": 2, "slack": 1},
        "nothing": {"none": 1, "slack": 1},
        "slack": {"slack": 1, "thermal-lag": 1},
        "tether": {"slack": 1},
    }


def test_reliability_of_statements() -> None:
    sure = [_outcome("none", [], ["none"], said=0.95) for _ in range(8)]
    wrong = [_outcome("none", [], ["slack"], said=0.95) for _ in range(2)]
    bins, error = reliability(sure + wrong, np.ones(10))
    assert [(one.said, one.true, one.statements) for one in bins] == [
        (pytest.approx(0.95), pytest.approx(0.8), 10)
    ]
    assert error == pytest.approx(0.15)
    assert counted(OUTCOMES)["cases"] == len(OUTCOMES)


def test_calibration_where_nothing_is_hidden_as_often_as_presumed() -> None:
    none = [_outcome("none", [], ["none"], said=0.7) for _ in range(9)]
    missed = [_outcome("single", ["slack"], ["none"], said=0.7)]
    assert as_presumed(none + missed) == pytest.approx([5 / 9] * 9 + [5.0])
    # Said with 0.7: true in 9 of 10, and in one half of what the probabilities presume.
    told = counted(none + missed)
    assert told["calibration_error"] == pytest.approx(0.2)
    assert told["calibration_error_as_presumed"] == pytest.approx(0.2)
    assert counted(none)["calibration_error_as_presumed"] == pytest.approx(0.3)


def test_cases_are_spread_over_all_effects() -> None:
    single = cases("single", 2 * len(EFFECTS), 3)
    on = {rig: [one.hidden[0] for one in single if one.rig == rig] for rig in RIG_NAMES}
    assert sorted(on["thesis"]) == sorted(EFFECTS)
    assert set(on["other"]) == set(HIDDEN)
    outside = cases("outside", 2 * len(OUTSIDE), 0)
    assert {one.hidden[0] for one in outside if one.rig == "thesis"} == set(OUTSIDE)
    assert {one.hidden[0] for one in outside if one.rig == "other"} == set(HIDDEN_OUTSIDE)
    assert len({one.name for one in single}) == len(single)
    assert all(len(set(one.hidden)) == 2 for one in cases("pair", 20, 0))


def test_power_tells_of_each_effect_how_strong_and_whether_named() -> None:
    assert power(OUTCOMES) == {"slack": [(0.1, False), (2.0, True), (2.0, True)]}


@pytest.mark.parametrize("rig", ["other", pytest.param("thesis", marks=pytest.mark.slow)])
def test_a_case_is_the_same_twice(rig: str, tmp_path: Path) -> None:
    case = next(one for one in cases("outside", 2, 5) if one.rig == rig)
    for name in "ab":
        (tmp_path / name).mkdir()
        write_runs(case, tmp_path / name)
    made = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert f"{case.held_out}.csv" in made
    for name in made:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
