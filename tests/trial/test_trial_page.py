"""The trial's figure and page, on outcomes made up for them."""

import json
from pathlib import Path

import pytest

from benchmarks.trial import count, page
from benchmarks.trial.cases import cases
from benchmarks.trial.counts import counted
from benchmarks.trial.outcome import trial_tasks
from benchmarks.trial.power import power_figure
from muscle_bayes.report.trial_figure import trial_figure


def _outcomes(count: int) -> list[dict]:
    said = {"none": 0.9, "slack": 0.05, "unknown": 0.05}
    one = {
        "kind": "none",
        "rig": "other",
        "hidden": [],
        "verdict": ["none"],
        "tie": [],
        "excess": 0.0,
    }
    return [
        one | {"probabilities": said, "ports": [], "tied_ports": [], "port": None, "held_out": 1.0}
    ] * count


def test_figure_shows_each_share_with_its_interval() -> None:
    left, right = trial_figure(counted(_outcomes(10))).axes
    assert [text.get_text() for text in left.texts] == ["10"]
    _, interval, share = (line.get_xydata() for line in right.lines)
    assert share.tolist() == [[pytest.approx(0.9), 1.0]]
    # Clopper and Pearson, 10 of 10: 0.025^(1/10).
    assert interval[:, 1] == pytest.approx([0.025**0.1, 1.0])


def test_power_is_drawn_by_strength() -> None:
    numbers = {"power": {"slack": [(0.1, False), (1.0, True)], "cogging": [(5.0, True)]}}
    above, below = power_figure(numbers, parts=1).axes
    (_, share) = (line.get_xydata().tolist() for line in above.lines)
    assert share == [[1.0, pytest.approx(2 / 3)]]
    assert [line.get_markerfacecolor() for line in below.lines].count("none") == 1


def test_page_says_how_much_of_the_trial_it_is(tmp_path: Path, monkeypatch) -> None:
    outcomes = _outcomes(7)
    assert page.extent({"none": 7}) == (
        "0 of 60 (single), 7 of 60 (none), 0 of 30 (outside), 0 of 30 (pair), "
        "**so not yet the whole trial**"
    )
    # More of one kind does not make up for another.
    assert page.missing({"none": 150, "single": 60}) == 60
    assert page.verdict({"wanted": "", "share": 0.5}, whole=True) == ""
    assert page.verdict({"wanted": ">= 80 %", "share": 0.9}, whole=True) == "holds"
    assert page.verdict({"wanted": ">= 80 %", "share": 0.7}, whole=False) == "**not so far**"
    monkeypatch.setattr(page, "DOCS", tmp_path)
    monkeypatch.setattr(page, "RESULTS", tmp_path / "results")
    (tmp_path / "outcomes.json").write_text("[]")
    (tmp_path / "trial.png").write_bytes(b"")
    (tmp_path / "trial-power.png").write_bytes(b"")
    for code, words in (
        (trial_tasks([]).stamp, "is that of this page"),
        ("0" * 64, "**Searched by earlier code**"),
    ):
        numbers = {"codes": {code: 7}, **counted(outcomes)}
        (tmp_path / "trial.json").write_text(json.dumps(numbers))
        page.main(tmp_path)
        told = (tmp_path / "trial.md").read_text()
        assert words in told
        assert (tmp_path / "results" / "trial.json").read_text() == "[]"
        assert "| none: something claimed | <= 3 % | 0 of 7 | 0% to 41% | so far |" in told


def test_page_says_how_many_outcomes_are_of_earlier_code() -> None:
    said = page.searched_by({trial_tasks([]).stamp: 4, "0" * 64: 1, "1" * 64: 1})
    assert said.startswith("2 of them were **searched by earlier code**")


def test_what_is_kept_counts_up_to_the_first_case_that_is_not(tmp_path: Path) -> None:
    for index, case in enumerate(cases("none", 6, 0)):
        if index != 4:
            kept = tmp_path / "cases" / f"{case.name}.json"
            kept.parent.mkdir(exist_ok=True)
            kept.write_text(json.dumps({"inputs": str(index % 2), "result": _outcomes(1)[0]}))
    count.main(tmp_path)
    numbers = json.loads((tmp_path / "trial.json").read_text())
    assert numbers["kinds"] == {"none": 5}
    assert numbers["codes"] == {"0": 2, "1": 3}
    assert len(json.loads((tmp_path / "outcomes.json").read_text())["outcomes"]) == 5
    assert (tmp_path / "trial.png").exists()
