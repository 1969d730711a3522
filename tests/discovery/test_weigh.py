"""Probabilities of candidates whose scores are given."""

from dataclasses import dataclass

import numpy as np
import pytest

from muscle_bayes.discovery.locate import SIGNIFICANT
from muscle_bayes.discovery.weigh import CLAIM, NONE, UNKNOWN, could_claim, unexplained, weigh

BLOCKS = np.repeat(np.arange(40), 5)


@dataclass
class Scored:
    """What `weigh` looks at of a fit."""

    log_densities: np.ndarray
    occam: float
    used: int = 3

    @property
    def log_evidence(self) -> float:
        return float(self.log_densities.sum()) + self.occam


def _scored(gain: np.ndarray | float, occam: float = -5.0) -> Scored:
    return Scored(np.zeros(BLOCKS.size) + gain, occam)


def test_what_counts_as_misfit_is_what_allows_a_claim() -> None:
    assert unexplained(SIGNIFICANT) == pytest.approx(CLAIM / (1.0 - CLAIM), rel=0.02)


def test_equal_candidates_share_what_none_leaves() -> None:
    none = _scored(0.0, 0.0)
    naming = weigh(none, {"a": _scored(0.0, 0.0), "b": _scored(0.0, 0.0)}, BLOCKS, 0)
    assert naming.probabilities == pytest.approx({NONE: 0.5, "a": 0.25, "b": 0.25})
    assert not naming.claims
    assert naming.tie == ()


def test_a_lead_that_all_blocks_share_is_claimed() -> None:
    naming = weigh(_scored(0.0, 0.0), {"a": _scored(0.2), "b": _scored(0.0)}, BLOCKS, 0)
    assert naming.best == "a"
    assert naming.claims
    assert naming.probabilities["a"] > 0.99
    assert naming.log_evidence["a"] == pytest.approx(0.2 * 200 - 5.0)
    assert naming.bic["a"] == pytest.approx(3.0 * np.log(200.0) - 2.0 * 0.2 * 200)


def test_the_same_lead_in_one_block_is_worth_less() -> None:
    one = np.where(BLOCKS == 7, 40.0 / 5.0, 0.0)
    naming = weigh(_scored(0.0, 0.0), {"a": _scored(one), "b": _scored(0.0)}, BLOCKS, 0)
    assert 0.5 < naming.probabilities["a"] < 0.95
    assert not naming.claims


def test_candidates_that_explain_the_same_tie() -> None:
    found = {"a": _scored(0.3), "b": _scored(0.3, -5.5), "c": _scored(0.0)}
    naming = weigh(_scored(0.0, 0.0), found, BLOCKS, 0)
    assert naming.tie == ("a", "b")


def test_unknown_takes_its_share() -> None:
    naming = weigh(_scored(0.0, 0.0), {"a": _scored(0.3)}, BLOCKS, 0)
    even = naming.with_unknown(1.0)
    assert sum(even.values()) == pytest.approx(1.0)
    assert even[UNKNOWN] == pytest.approx(0.05)
    assert naming.with_unknown(np.inf)[UNKNOWN] == pytest.approx(1.0)


def test_a_misfit_that_nothing_explains_speaks_for_unknown_against_none_only() -> None:
    against = unexplained(1e-12)
    nothing = weigh(_scored(0.0, 0.0), {"a": _scored(-0.1)}, BLOCKS, 0)
    assert nothing.with_unknown(1.0)[UNKNOWN] < 0.1
    assert nothing.with_unknown(1.0, against)[UNKNOWN] > 0.999
    named = weigh(_scored(0.0, 0.0), {"a": _scored(2.0)}, BLOCKS, 0)
    assert named.probabilities[NONE] < 1e-12
    assert named.with_unknown(1.0, against)["a"] == pytest.approx(0.95, abs=0.01)
    told = nothing.with_unknown(1.0, against)
    assert sum(told.values()) == pytest.approx(1.0)


def test_odds_of_a_p_value() -> None:
    assert unexplained(0.5) == 1.0
    assert unexplained(0.05) == pytest.approx(1.0 / 0.407, rel=1e-3)  # Sellke et al., table 1
    assert unexplained(0.01) == pytest.approx(1.0 / 0.125, rel=3e-3)


def test_an_effect_is_no_likelier_than_the_misfit_is_significant() -> None:
    sure = weigh(_scored(0.0, 0.0), {"a": _scored(0.2), "b": _scored(0.1)}, BLOCKS, 0)
    assert sure.claims
    unseen = sure.supported(0.6)
    assert unseen.probabilities[NONE] == pytest.approx(0.5)
    assert not unseen.claims
    ratio = sure.probabilities["b"] / sure.probabilities["a"]
    assert unseen.probabilities["b"] / unseen.probabilities["a"] == pytest.approx(ratio)
    assert sum(unseen.probabilities.values()) == pytest.approx(1.0)
    assert sure.supported(1e-12).claims


@pytest.mark.parametrize("p_value", [0.6, 0.02, 0.0101, 0.0099, 1e-12])
def test_a_search_is_given_up_only_where_the_surest_of_candidates_could_not_be_claimed(p_value):
    sure = weigh(_scored(0.0, 0.0), {"a": _scored(0.2), "b": _scored(0.1)}, BLOCKS, 0)
    assert could_claim(p_value) == sure.supported(p_value).claims


def test_a_misfit_adds_nothing_to_the_evidence_for_effects() -> None:
    naming = weigh(_scored(0.0, 0.0), {"a": _scored(-0.1)}, BLOCKS, 0)
    assert naming.supported(1e-12) == naming
