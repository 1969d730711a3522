"""Lines that say how long computations are, where there is no terminal."""

from io import StringIO

import pytest

from muscle_bayes import progress
from muscle_bayes.progress import _Lines


def test_a_stage_that_begins_again_has_a_time_to_go(monkeypatch: pytest.MonkeyPatch) -> None:
    now = iter(range(0, 1000, 20))
    monkeypatch.setattr(progress, "monotonic", lambda: next(now))
    out = StringIO()
    report = _Lines(out)
    for done in (0, 50, 100, 150, 25, 75, 150):
        report("sampling; note", done, 150)
    lines = out.getvalue().splitlines()
    assert len(lines) == 7
    assert all("-" not in line for line in lines)
    assert "to go" not in lines[4]
    assert "to go" in lines[5]
