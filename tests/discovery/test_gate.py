"""Whether an effect passes the gate."""

from pathlib import Path

import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.discovery.compare import compare
from muscle_bayes.discovery.conditions import traces
from muscle_bayes.discovery.explanation import Explanation, Search
from muscle_bayes.discovery.gate import Gate, _gate, gate_by_runs
from muscle_bayes.discovery.nominal import nest, nominal
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.search.descent import descend
from muscle_bayes.trial.cases import HELD_OUT, Case, data_set
from muscle_bayes.twin import save_runs


def test_gain_and_error_are_those_of_blocks() -> None:
    difference = np.array([1.0, 2.0, 3.0, 6.0, 9.0])
    blocks = np.array([0, 0, 1, 4, -1])
    found = _gate(difference, blocks, "blocks")
    sums = np.array([3.0, 3.0, 6.0])
    assert found.gain == pytest.approx(sums.sum())
    assert found.se == pytest.approx(np.sqrt(3.0) * sums.std(ddof=1))


def test_one_clear_part_is_enough_unless_the_other_speaks_against_it() -> None:
    clear, dim, against = (
        Gate(20.0, 4.0, "runs"),
        Gate(100.0, 65.0, "blocks"),
        Gate(-9.0, 3.0, "runs"),
    )
    assert clear.weighed_with(dim) is clear
    assert dim.weighed_with(clear).passed
    assert not dim.passed
    assert clear.weighed_with(against) is against
    assert not against.passed


@pytest.mark.slow
@double_precision
def test_a_model_is_judged_with_its_own_motion_in_runs_that_were_held_out(tmp_path: Path) -> None:
    """The wrong model, fitted to them too with the motion of its fit without them, gains more by them
    than the right one."""
    case = Case("single", ("second-relaxation",), 3)
    save_runs(tmp_path / "runs", data_set(case))
    runs = read_runs([tmp_path / "runs"])
    whole, point = nest(nominal(runs, "coulomb", (), case.seed, (HELD_OUT,)), list(case.hidden))
    search = Search(whole, whole, (HELD_OUT,), case.seed, lambda *told: None, 2).over(whole)
    base = Explanation(search, descend(search.train, (), point)).settled()
    compared = compare(base, list(case.hidden))
    pair = compared.found["second-relaxation"], compared.base

    def rise(one: Explanation) -> float:
        frozen = descend(one.search.whole, one.fitted.effects, one.fitted.point)
        return frozen.log_evidence - one.fitted.log_evidence

    right, wrong = map(rise, pair)
    assert right < wrong - 10.0
    gate = gate_by_runs(pair[1], pair[0], traces(pair[1].search.whole, pair[1].fitted))
    assert gate.passed
