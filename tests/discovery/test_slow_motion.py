"""Candidates are searched in slow motion alone, and each counts with its own motion."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.discovery import compare as comparison
from muscle_bayes.discovery.compare import compare, with_own_motion
from muscle_bayes.discovery.explanation import Explanation, Search
from muscle_bayes.discovery.nominal import nest, nominal
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.search.descent import descend
from muscle_bayes.trial.cases import HELD_OUT, Case, data_set
from muscle_bayes.twin import save_runs


class _Moved:
    """A candidate whose own motion adds what it is told to its evidence."""

    gains: dict[str, float] = {}  # noqa: RUF012

    def __init__(self, search: Any, fitted: Any) -> None:
        self.search, self.fitted = search, fitted

    def settled(self) -> "_Moved":
        name = self.fitted.name
        settled = SimpleNamespace(
            name=name, log_evidence=self.fitted.log_evidence + self.gains[name]
        )
        return _Moved("settled", settled)


def _settled(
    monkeypatch: pytest.MonkeyPatch, workers: int, **candidates: tuple[float, float, float]
) -> dict[str, tuple[str, float]]:
    """Of each candidate: evidence in slow motion, with the base's motion, and gain by its own."""
    monkeypatch.setattr(comparison, "Explanation", _Moved)
    monkeypatch.setattr(
        comparison,
        "descend",
        lambda train, effects, point: SimpleNamespace(name=effects, log_evidence=point),
    )
    monkeypatch.setattr(_Moved, "gains", {name: told[2] for name, told in candidates.items()})
    fits: dict[str, Any] = {
        name: SimpleNamespace(name=name, effects=name, point=beside, log_evidence=slow)
        for name, (slow, beside, _) in candidates.items()
    }
    search: Any = SimpleNamespace(workers=workers)
    base: Any = SimpleNamespace(search=SimpleNamespace(train=None))
    found = with_own_motion(search, fits, base)
    assert list(found) == list(fits)
    return {
        name: ("settled" if one.search == "settled" else "beside", one.fitted.log_evidence)
        for name, one in found.items()
    }


@pytest.mark.parametrize("workers", [1, 2])
def test_the_likeliest_in_slow_motion_settle(monkeypatch, workers) -> None:
    found = _settled(
        monkeypatch,
        workers,
        far=(-300.0, -280.0, 0.0),
        a=(-90.0, -200.0, 500.0),
        b=(0.0, -50.0, 10.0),
    )
    assert found == {"far": ("beside", -280.0), "a": ("settled", 410.0), "b": ("settled", 10.0)}


def test_none_wins_by_motion_that_is_not_its_own(monkeypatch) -> None:
    found = _settled(
        monkeypatch,
        1,
        best=(0.0, 0.0, -400.0),
        far=(-300.0, -300.0, -300.0),
        last=(-700.0, -450.0, 0.0),
    )
    assert found == {
        "best": ("settled", -400.0),
        "far": ("settled", -600.0),
        "last": ("beside", -450.0),
    }


def test_no_candidate_is_left(monkeypatch) -> None:
    assert _settled(monkeypatch, 2) == {}


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "seed"), [("slack", 16), ("second-relaxation", 18)])
@double_precision
def test_motion_of_a_wrong_model_hides_no_effect(tmp_path: Path, effect: str, seed: int) -> None:
    """The search ends where one of the model with the effect from its prior does."""
    save_runs(tmp_path / "runs", data_set(Case("single", (effect,), seed)))
    runs = read_runs([tmp_path / "runs"])

    def explained(present: tuple[str, ...], candidates: list[str]) -> Explanation:
        whole, point = nest(nominal(runs, "coulomb", present, seed, (HELD_OUT,)), candidates)
        search = Search(whole, whole, (HELD_OUT,), seed, lambda *told: None, 2).over(whole)
        return Explanation(search, descend(search.train, present, point)).settled()

    base, known = explained((), [effect]), explained((effect,), [])
    found = compare(base, [effect]).found[effect].fitted.log_evidence
    assert found > known.fitted.log_evidence - 20.0
    assert found > base.fitted.log_evidence + 100.0
