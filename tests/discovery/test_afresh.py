"""Where misfit is gross, candidates are started at draws of the prior as well."""

from pathlib import Path

import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.discovery.explanation import Explanation, Search
from muscle_bayes.discovery.nominal import nest, nominal
from muscle_bayes.discovery.search import finished, first_steps, fit_afresh, screen
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.search.descent import descend
from muscle_bayes.trial.cases import HELD_OUT, Case, data_set
from muscle_bayes.twin import save_runs

EFFECT = "modulus-temperature"


@pytest.mark.slow
@double_precision
def test_a_wrong_model_s_parameters_hide_no_effect(tmp_path: Path) -> None:
    """Of two hidden effects one explains a thousand nat, but not from where the model without it fits:
    there HYST is shut. The search of the model with it from its prior ends where draws lead."""
    case = Case("pair", ("bias-torque", EFFECT), 3)
    save_runs(tmp_path / "runs", data_set(case))
    runs = read_runs([tmp_path / "runs"])

    def explained(present: tuple[str, ...], candidates: list[str]) -> Explanation:
        start = nominal(runs, "coulomb", present, case.seed, (HELD_OUT,))
        whole, point = nest(start, candidates)
        search = Search(whole, whole, (HELD_OUT,), case.seed, lambda *told: None, 2).over(whole)
        return Explanation(search, descend(search.train, present, point)).settled()

    base, known = explained((), [EFFECT]), explained((EFFECT,), [])
    slow = base.search.without_swings()
    here = descend(slow.train, (), base.fitted.point)
    starts = screen(slow.train, here, [EFFECT], case.seed)[EFFECT]
    beside = finished(slow.train, here, first_steps(slow.train, here, EFFECT, starts))
    found = fit_afresh(slow.train, here, [EFFECT], case.seed)[EFFECT]
    own = Explanation(slow, found).settled()
    assert own.fitted.log_evidence > known.fitted.log_evidence - 20.0
    assert found.log_evidence > beside.log_evidence + 500.0
