"""Candidates beside a base that a candidate has bettered."""

from types import SimpleNamespace

import pytest

from muscle_bayes.discovery import search


def _fitted(log_evidence: float) -> SimpleNamespace:
    return SimpleNamespace(log_evidence=log_evidence)


@pytest.fixture
def bases(monkeypatch) -> list[float]:
    """Log evidence of the bases beside which candidates are screened, in order."""
    seen: list[float] = []

    def screen(nested, base, names, seed, workers):
        seen.append(base.log_evidence)
        return {name: [] for name in names}

    monkeypatch.setattr(search, "screen", screen)
    # `a` explains 5 nat beside any base, `b` 30 beside the first only.
    monkeypatch.setattr(
        search,
        "fit_candidates",
        lambda nested, base, screened, seed, report, workers: {
            "a": _fitted(base.log_evidence + 5.0),
            "b": _fitted(30.0 if base.log_evidence == 0.0 else 10.0),
        },
    )
    monkeypatch.setattr(search, "fit_afresh", lambda nested, base, names, seed, workers: {})
    monkeypatch.setattr(
        search, "searched_further", lambda nested, base, found, seed, workers: found
    )
    return seen


def test_candidates_are_searched_anew_beside_a_better_base(bases, monkeypatch) -> None:
    monkeypatch.setattr(search, "without_last", lambda nested, fits, base, workers: _fitted(70.0))
    found = search.search_candidates(None, _fitted(0.0), ["a", "b"], 0)
    assert bases == [0.0, 70.0]
    assert found.base.log_evidence == 70.0
    # Each at the best point of all rounds.
    assert {name: one.log_evidence for name, one in found.fits.items()} == {"a": 75.0, "b": 30.0}


def test_a_base_that_stays_is_compared_once(bases, monkeypatch) -> None:
    monkeypatch.setattr(search, "without_last", lambda nested, fits, base, workers: _fitted(1.0))
    assert search.search_candidates(None, _fitted(0.0), ["a", "b"], 0).base.log_evidence == 1.0
    assert bases == [0.0]


def test_what_is_found_afresh_counts_once(bases, monkeypatch) -> None:
    monkeypatch.setattr(search, "without_last", lambda nested, fits, base, workers: _fitted(70.0))
    asked = []

    def fit_afresh(nested, base, names, seed, workers):
        asked.append(base.log_evidence)
        return {"b": _fitted(90.0)}

    def searched_further(nested, base, found, seed, workers):
        further.append(found["b"].log_evidence)
        return found

    further: list[float] = []
    monkeypatch.setattr(search, "fit_afresh", fit_afresh)
    monkeypatch.setattr(search, "searched_further", searched_further)
    found = search.search_candidates(None, _fitted(0.0), ["a", "b"], 0)
    assert {name: one.log_evidence for name, one in found.fits.items()} == {"a": 75.0, "b": 90.0}
    assert asked == [0.0]
    # Beside the later base `b` is worth 10: what is searched further is the best there was.
    assert further == [90.0]
