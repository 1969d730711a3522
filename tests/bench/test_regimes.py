"""The thesis' regimes as sequences."""

import pytest

from muscle_bayes.bench.sequences.regimes import (
    REGIMES,
    T2_LOADS,
    T2_TEMPERATURES,
    t1,
    t2,
    with_loads,
)
from muscle_bayes.bench.sequences.sequence_file import parse_sequence, to_toml
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin import protocols


@pytest.mark.parametrize("name", REGIMES)
@pytest.mark.parametrize("room", [18.0, 25.0, 29.5])
def test_written_and_read_again_is_the_same(name, room):
    sequence = REGIMES[name].build(room)
    assert parse_sequence(to_toml(sequence, REGIMES[name].about).encode(), name) == sequence


def unrolled(run):
    return [
        stage
        for block in run.stage
        for stage in (block.stages * block.repeat if hasattr(block, "repeat") else (block,))
    ]


@pytest.mark.parametrize(
    ("name", "simulated"),
    [("staircase", protocols.staircase(0.139)), ("sawtooth", protocols.sawtooth())],
)
def test_is_what_the_twin_simulates(name, simulated):
    """Setpoints and loads; the twin gives its first training stage the load that hangs already."""
    run = REGIMES[name].build(25.0).runs(name)[0]
    ours = [(s.setpoint_a, s.duration, s.load, s.logged) for s in unrolled(run)]
    first, *others = [(s.setpoint_a, s.duration, s.load, s.logged) for s in simulated.stages]
    assert ours == [(first[0], first[1], None, first[3]), *others]
    assert run.load == simulated.load


def test_t2_has_every_permutation_once_and_follows_the_thesis():
    runs = t2(25.0).runs("t2")
    seen = set()
    for run in runs:
        i, ii, iii, iv, v, vi, vii, viii = run.stage
        assert [s.setpoint_a for s in (i, ii, iii, v, vi, viii)] == [90, 25, 25, 25, 25, 90]
        assert i.load == run.load == 0.275
        seen.add((iii.load, vi.load, iv.setpoint_a, vii.setpoint_a))
    assert len(runs) == len(seen) == 256
    assert {start for start, *_ in seen} == set(T2_LOADS)
    assert {hot for *_, hot in seen} == set(T2_TEMPERATURES)
    assert len({run.name for run in runs}) == 256


def test_t1_lowers_its_peak_and_never_exceeds_it():
    runs = t1(25.0).runs("t1")
    assert [run.name for run in runs] == [f"t1-{peak}c" for peak in (90, 80, 70, 60, 50, 40)]
    for run, peak in zip(runs, (90, 80, 70, 60, 50, 40), strict=True):
        reset, *others = run.stage
        assert (reset.repeat, reset.stages[0].setpoint_a) == (5, 90.0)
        within = [s.setpoint_a for block in others for s in getattr(block, "stages", (block,))]
        assert max(within) == peak
        loads = [block.load for block in others if getattr(block, "load", None) is not None]
        assert loads == [0.275, 0.475, 0.675, 0.875, 1.075]


def test_loads_are_chosen():
    runs = with_loads("staircase", 25.0, [0.1, 0.2]).runs("x")
    assert [run.name for run in runs] == ["staircase-100g", "staircase-200g"]


def test_loads_are_refused_where_they_belong_to_the_regime():
    with pytest.raises(MuscleBayesError, match="t2 has loads of its own"):
        with_loads("t2", 25.0, [0.1])
    with pytest.raises(MuscleBayesError, match="no load"):
        with_loads("sawtooth", 25.0, [-0.1])
    with pytest.raises(MuscleBayesError, match=r"139 kg are more than 20 kg.*write 0\.139"):
        with_loads("sawtooth", 25.0, [139.0])
