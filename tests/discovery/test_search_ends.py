"""A search that is interrupted, or whose budget ends, answers from what it has."""

from dataclasses import replace
from pathlib import Path

import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.data.writer import write_run
from muscle_bayes.discovery.discover import discover
from muscle_bayes.report.discovery_summary import summary, verdict_text
from muscle_bayes.twin import Rig, make_effect, simulate, spring_rig
from muscle_bayes.twin.protocols import spring

CANDIDATES = ("viscous-friction", "bias-torque", "quadratic-drag")


@pytest.fixture
def runs(tmp_path: Path):
    hidden = make_effect("viscous-friction", coefficient=1e-3)
    rig = spring_rig(Rig())
    rig = replace(rig, truth=replace(rig.truth, effects=(hidden,)))
    for number, mass in enumerate((0.100, 0.110, 0.118, 0.126), 1):
        run = simulate(rig, spring(mass), (11, number))
        write_run(tmp_path, f"spring-{number}", run.log, run.metadata)
    return read_runs([tmp_path])


def test_an_interrupt_keeps_what_is_found(runs) -> None:
    def interrupted(stage: str, done: int, total: int) -> None:
        if stage == "gate":
            raise KeyboardInterrupt

    told: list[str] = []
    found = discover(runs, candidates=CANDIDATES, report=interrupted, told=told.append)
    assert found.steps == ()
    assert found.located.significant
    assert found.probabilities["viscous-friction"] > 0.3
    assert "interrupted" in found.stopped_because
    (missing,) = found.not_searched
    assert missing in summary(found, {})
    assert "did not end" in verdict_text(found)
    assert told == [found.visible.text()]  # type: ignore[union-attr]


def test_a_budget_ends_the_search(runs) -> None:
    found = discover(runs, candidates=CANDIDATES, budget=0.0)
    assert found.verdict in ("none", "unknown")
    assert found.stopped_because == "the budget ended"
    assert found.not_searched


def test_a_misfit_below_the_least_that_counts_is_small(runs) -> None:
    found = discover(runs, candidates=CANDIDATES, smallest=1e3)
    assert found.verdict == "none"
    assert "small" in found.stopped_because
    assert "small" in verdict_text(found)
