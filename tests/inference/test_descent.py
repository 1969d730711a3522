"""Where a descent ends."""

from pathlib import Path

import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.discovery.nominal import nest, nominal
from muscle_bayes.inference import damped_steps, descent
from muscle_bayes.inference.descent import descend
from muscle_bayes.inference.precision import double_precision

DATA = Path(__file__).parents[2] / "data"


@double_precision
def test_steps_that_are_cut_short_do_not_end_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A coordinate in a unit far below its width: each step gains little, the way is long."""
    start = nominal(read_runs([DATA / "spring-1.csv"]), "coulomb", (), 0)
    nested, point = nest(start, ["bias-torque"])
    mode = descend(nested, (), point)
    entry = nested.shared_names().index("fast.correlation_time")
    far = np.sqrt(4.0 / mode.information[entry, entry])
    begun = mode.point.copy()
    begun[entry] += far
    for module in (damped_steps, descent):
        monkeypatch.setattr(module, "LONGEST_MOVE", far / 60.0)
    first = descend(nested, (), begun, 1)
    assert 0.0 < descend(nested, (), begun, 0).potential - first.potential < descent.LEAST_GAIN
    assert descend(nested, (), begun, 200).potential == pytest.approx(mode.potential, abs=0.3)
    monkeypatch.setattr(descent, "CUT", np.inf)
    assert descend(nested, (), begun, 200).potential > mode.potential + 1.0
