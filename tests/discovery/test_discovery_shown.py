"""Results of discovery as notebooks show them: all that was found, and nothing taken for markup."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from muscle_bayes.discovery.locate import Located, MisfitMap
from muscle_bayes.discovery.outcome import _verdict
from muscle_bayes.discovery.result import NextExperiment, Step
from muscle_bayes.report.discovery_summary import verdict_text

WINDOW = Located("<run>", 10.0, 20.0, "sigma < 0 and T > 80 C", 1.5, "counts", 0.004, 0.8)


def test_a_misfit_map_tells_its_windows():
    shown = MisfitMap((WINDOW,), 0.004, 12.0, ())._repr_html_()
    for words in ("1 windows located, p = 0.004", "&lt;run&gt;", "sigma &lt; 0", "10 to 20", "80%"):
        assert words in shown
    assert "<run>" not in shown
    assert "nothing located" in MisfitMap((), 0.4, 0.0, ())._repr_html_()


def test_a_next_experiment_tells_what_it_separates_and_how():
    one = NextExperiment("staircase, 139 g", ("slack", "thermal-lag"), 3.2, "load < 0.2 # kg")
    shown = one._repr_html_()
    for words in ("staircase, 139 g", "slack from thermal-lag", "3.2 nat", "load &lt; 0.2"):
        assert words in shown
    by_hand = NextExperiment("swing-1 again, but begun at 90 deg", ("backlash", "none"), 3.2)
    assert "sequence" not in by_hand._repr_html_()


def test_the_share_of_a_gap_is_told_only_where_chance_does_not_leave_as_much():
    def judged(rmse: float):
        return SimpleNamespace(checks={"run": SimpleNamespace(rmse=rmse, pit=np.zeros(200))})

    step = SimpleNamespace(before=judged(2.0), after=judged(1.0))
    assert Step.closed(step, "run", 1.0) == pytest.approx(1.0)
    assert Step.closed(step, "run", 0.5) == pytest.approx(3.0 / 3.75)
    assert Step.closed(step, "run", 1.9) is None


def _found(verdict: str, left: MisfitMap, probabilities: dict[str, float]) -> SimpleNamespace:
    final = SimpleNamespace(misfit=left)
    more = {"not_searched": (), "smallest": 0.25, "remainder": None}
    return SimpleNamespace(
        verdict=verdict, steps=(), probabilities=probabilities, final=final, **more
    )


@pytest.mark.parametrize(
    ("none", "verdict"), [(0.05, "unknown"), (0.39, "none")], ids=["sure", "may be chance"]
)
def test_what_nothing_explains_is_claimed_if_it_is_hardly_chance(none: float, verdict: str):
    left = MisfitMap((WINDOW,), 0.0028, 12.0, ())
    probabilities = {"slack": 0.1, "unknown": 0.9 - none, "none": none}
    assert _verdict((), probabilities, left, 0.25) == verdict
    told = verdict_text(_found(verdict, left, probabilities))
    if verdict == "unknown":
        assert told.startswith("Something is missing")
    for words in ("p = 0.0028", "none: 39%", "unknown: 51%"):
        assert (words in told) == (verdict == "none")


def test_nothing_is_claimed_where_nothing_is_significant_or_all_is_small():
    probabilities = {"slack": 0.1, "unknown": 0.85, "none": 0.05}
    calm = MisfitMap((), 0.4, 0.0, ())
    assert _verdict((), probabilities, calm, 0.25) == "none"
    told = verdict_text(_found("none", calm, probabilities))
    assert told == "Nothing is missing that these runs could show."
    small = MisfitMap((replace(WINDOW, steps=0.1),), 1e-9, 12.0, ())
    assert _verdict((), probabilities, small, 0.25) == "none"
    assert "small, 0.1 steps of the sensor" in verdict_text(_found("none", small, probabilities))
    assert _verdict((), probabilities, small, 0.05) == "unknown"
