"""SEQUENCE.toml: what it holds, and errors that name file and key."""

import pytest

from muscle_bayes.bench.sequences.sequence import Repeat, Sequence, Stage
from muscle_bayes.bench.sequences.sequence_file import (
    parse_sequence,
    read_rig,
    read_sequence,
    run_metadata,
    to_toml,
)
from muscle_bayes.data import Fixture, MuscleElement, RunError
from muscle_bayes.twin.plans import read_stages

WHOLE = """
format = 1
name = "bend-1"
protocol = "staircase"
notes = "second spool"
load = 0.06
log_period = 0.05

[fixture]
rotor_radius_a = 0.03
anchor_x_a = 0.03
anchor_y_a = 0.115
disc_radius = 0.0889

[potentiometer]
zero_reading = 512.0
radians_per_count = 0.0058

[element_a]
kind = "muscle"
base_length = 0.1

[limits]
max_temperature = 100.0
reconnect_time = 5

[stop]
duration = 900

[[stage]]
setpoint_a = 25.0
duration = 10.0

[[stage]]
repeat = 3
until_within = 3.0
stages = [{ setpoint_a = 90.0 }, { setpoint_a = 25.0, wait = 60.0 }]

[[stage]]
load = 0.139
pour_time = 4.0
duration = 5.0
note = "pour slowly"
"""


def test_whole_sequence():
    sequence = parse_sequence(WHOLE.encode(), "bend.toml")
    (run,) = sequence.runs("bend")
    assert run.name == "bend-1"
    assert run.load == 0.06
    assert isinstance(run.stage[1], Repeat)
    assert [stage.setpoint_a for stage in run.once_through()] == [25.0, 90.0, 25.0, None]
    assert run.heats("a")
    assert not run.heats("b")
    assert sequence.limits.reconnect_time == 5
    metadata = run_metadata(sequence, "bend.toml", "measured", {}, run.load, "by hand.")
    assert metadata.protocol == "staircase"
    assert metadata.notes == "second spool by hand."
    assert metadata.load.mass == (0.06,)
    assert metadata.element_b.kind == "none"


def test_written_and_read_again_is_the_same():
    sequence = parse_sequence(WHOLE.encode(), "bend.toml")
    text = to_toml(sequence, "a head\n\nof three lines")
    assert text.startswith("# a head\n#\n# of three lines\nformat = 1\n")
    assert parse_sequence(text.encode(), "again.toml") == sequence


def test_stages_of_a_simulated_free_protocol_are_a_sequence(tmp_path):
    """What `simulate free --stages` takes, `record` takes as it is."""
    path = tmp_path / "next.toml"
    path.write_text(
        "load = 0.139\ninitial_hyst = 0.03\nlog_period = 0.05\n"
        "[[stage]]\nsetpoint_a = 60.0\nwait = 5.0\n"
        "[[stage]]\nsetpoint_a = 25.0\nduration = 30.0\nload = 0.166\npour_time = 2.0\n"
    )
    simulated, sequence = read_stages(path), read_sequence(path)
    (run,) = sequence.runs("next")
    for ours, twins in zip(run.stage, simulated.stages, strict=True):
        for key in ("setpoint_a", "setpoint_b", "duration", "wait", "load", "pour_time", "logged"):
            assert getattr(ours, key) == getattr(twins, key)
    assert (run.load, sequence.initial_hyst) == (simulated.load, simulated.initial_hyst)


BROKEN = {
    "unknown key": ("setpoint_a = 25.0", "setpoint_c = 25.0", "key stage[1].setpoint_c", "mean"),
    "unknown in repeat": ("wait = 60.0", "waite = 1", "key stage[2].stages[2].waite", "'wait'"),
    "no end": ("setpoint_a = 25.0\nduration = 10.0", "wait = 2", "stage[1].duration", "missing"),
    "too hot": ("setpoint_a = 90.0", "setpoint_a = 190.0", "stages[1].setpoint_a", "105"),
    "no room": ("max_temperature = 100.0", "max_temperature = 92.0", "max_temperature", "5 C"),
    "beyond firmware": ("max_temperature = 100.0", "max_temperature = 120.0", "limits.max", "110"),
    "bad name": ('name = "bend-1"', 'name = "a/b"', "key name", "no name for files"),
    "text": ("duration = 900", 'duration = "long"', "key stop.duration", "'long'"),
    "negative": ("load = 0.06", "load = -0.06", "key load", "-0.06"),
    "element": ('kind = "muscle"', 'kind = "mucle"', "element_a.kind", "did you mean 'muscle'"),
    "no stages": (WHOLE[WHOLE.index("[[stage]]") :], "", "key stage", "missing"),
    "no passes": ("repeat = 3", "repeat = 0", "key stage[2].repeat", "0"),
    "not TOML": ("format = 1", "format =", "bend.toml", "not valid TOML"),
    "never logged": (
        WHOLE[WHOLE.index("[[stage]]") :],
        "[[stage]]\nduration = 1\nlogged = false",
        "key stage",
        "no stage is logged",
    ),
}


@pytest.mark.parametrize("case", BROKEN)
def test_errors_name_file_and_key(case):
    before, after, *told = BROKEN[case]
    assert before in WHOLE
    with pytest.raises(RunError) as caught:
        parse_sequence(WHOLE.replace(before, after).encode(), "bend.toml")
    for words in ["bend.toml", "Fix: ", *told]:
        assert words in str(caught.value)


def test_two_runs_of_one_name():
    run = '[[run]]\nname = "same"\nstage = [{ duration = 1.0 }]\n'
    with pytest.raises(RunError, match="'same' is the name of two runs"):
        parse_sequence((run + run).encode(), "x.toml")


def test_stages_and_runs_together():
    run = '[[run]]\nname = "same"\nstage = [{ duration = 1.0 }]\n'
    with pytest.raises(RunError, match=r"given together with \[\[run\]\]"):
        parse_sequence(f"{run}[[stage]]\nduration = 1.0\n".encode(), "x.toml")


def test_rig_comes_from_a_file_of_its_own(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(WHOLE[WHOLE.index("[fixture]") : WHOLE.index("[limits]")] + "[other]\nx = 1\n")
    rig = read_rig(path)
    assert isinstance(rig["fixture"], Fixture)
    assert isinstance(rig["element_a"], MuscleElement)
    bare = Sequence(stage=(Stage(duration=1.0),))
    assert run_metadata(bare, "x.toml", "measured", rig, 0.1).fixture.disc_radius == 0.0889


def test_rig_that_is_missing_is_told_with_its_key():
    bare = Sequence(stage=(Stage(duration=1.0),))
    with pytest.raises(RunError, match=r"x.toml, key element_a: missing.*--rig FILE"):
        run_metadata(bare, "x.toml", "measured", {}, 0.0)


def test_rig_file_without_a_rig(tmp_path):
    (tmp_path / "rig.toml").write_text("x = 1\n")
    with pytest.raises(RunError, match="no table of a rig"):
        read_rig(tmp_path / "rig.toml")
