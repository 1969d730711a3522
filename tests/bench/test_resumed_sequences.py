"""Sequences of many runs go on where they broke off."""

from pathlib import Path

import pytest
from fake_bench import RIG, FakeBench

from muscle_bayes.bench.recording.loop import StoppedError
from muscle_bayes.bench.recording.session import Session
from muscle_bayes.bench.sequences.regimes import t2
from muscle_bayes.bench.sequences.sequence import Stage
from muscle_bayes.data import read_run


def brief(sequence):
    """The same runs by name and load, each over in a moment."""
    stages = (Stage(duration=0.3),)
    runs = tuple(run.model_copy(update={"stage": stages}) for run in sequence.run)
    return sequence.model_copy(update={"run": runs})


def session(folder, stop_at=float("inf")):
    bench = FakeBench()
    bench.operator.delay = 0.0
    bench.operator.stop_at = stop_at
    made = Session(
        brief(t2(25.0)), Path("t2.toml"), folder, bench.devices(), bench.operator, rig=RIG
    )
    made.devices.open()
    return made


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_all_permutations_of_t2_are_recorded_over_two_breaks(tmp_path):
    names = [run.name for run in t2(25.0).run]
    kept = {}
    for number, stop_at in enumerate((20.0, 30.0)):
        with pytest.raises(StoppedError):
            list(session(tmp_path, stop_at).record())
        now = contents(tmp_path)
        assert kept.items() <= now.items()  # a break changes nothing of what was there
        assert len(now) > len(kept) + 60
        kept = now
        broken = [name for name in names if f"{name}.csv" in kept]
        assert len(broken) == len(set(broken)) > 20 * (number + 1)
    last = session(tmp_path)
    recorded = last.recorded()
    outcomes = [outcome.name for outcome in last.record()]
    assert len(recorded) + len(outcomes) == 256
    again = [name.removesuffix("-again") for name in outcomes]
    assert [*recorded, *again] == names
    assert kept.items() <= contents(tmp_path).items()
    assert 1 <= len([name for name in outcomes if name.endswith("-again")]) <= 2
    assert list(session(tmp_path).record()) == []
    for name in (names[0], outcomes[0], names[-1]):
        assert read_run(tmp_path / f"{name}.csv").metadata.load.mass == (0.275,)
