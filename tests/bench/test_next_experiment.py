"""What discovery proposes as the next experiment is a sequence that `record` takes as it is."""

import json

import numpy as np
import pytest
from fake_bench import RIG, FakeBench
from typer.testing import CliRunner

from muscle_bayes.bench.recording.loop import StoppedError
from muscle_bayes.bench.recording.session import Session
from muscle_bayes.bench.sequences.sequence_file import read_sequence, to_toml
from muscle_bayes.cli import app
from muscle_bayes.data import read_run
from muscle_bayes.discovery.next_experiment import Thermal, course, plans

ROOM, LOADS = 24.3, (0.139, 0.2125)
PROPOSED = list(plans(ROOM, LOADS))
HEAD = "To tell coil-contact from none: expected log odds 12.3 nat."


def written(plan, folder):
    path = folder / "next-experiment.toml"
    path.write_text(to_toml(plan.sequence, HEAD), encoding="utf-8")
    return path


def session(path, folder, bench):
    made = Session(
        read_sequence(path), path, folder, bench.devices(), bench.operator, rig=RIG, load=0.06
    )
    made.check()
    made.devices.open()
    return made


@pytest.mark.parametrize("number", range(len(PROPOSED)))
def test_every_proposal_is_taken_and_begun(tmp_path, number):
    plan = PROPOSED[number]
    path = written(plan, tmp_path)
    assert read_sequence(path) == plan.sequence
    bench = FakeBench(room=ROOM)
    bench.operator.stop_at = 1.0
    made = session(path, tmp_path / "runs", bench)
    (run,) = made.plans()
    with pytest.raises(StoppedError):
        list(made.record())
    assert bench.tubes[0] > ROOM + 1.0  # training heats at once
    assert (tmp_path / "runs" / f"{run.name}.toml").exists()


def test_the_command_takes_it(firmware, tmp_path):
    """Ended early by a limit that is added: whole it takes minutes."""
    path = written(PROPOSED[1], tmp_path)
    told = tmp_path / "told.json"
    path.write_text(f"{path.read_text()}[limits]\nstage_timeout = 2.0\n")
    result = CliRunner().invoke(
        app,
        ["record", str(path), "--out", str(tmp_path / "runs"), "--simulate", "--json", str(told)],
    )
    assert result.exit_code == 2
    assert "was not stable after 2 s" in json.loads(told.read_text())["error"]


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1])
def test_recorded_to_its_end_it_lasts_as_long_as_was_imagined(tmp_path, number):
    plan = PROPOSED[number]
    bench = FakeBench(room=ROOM)
    (outcome,) = session(written(plan, tmp_path), tmp_path / "runs", bench).record()
    assert outcome.complete
    run = read_run(tmp_path / "runs" / f"{outcome.name}.csv")
    assert run.repairs == ()
    assert run.metadata.protocol == plan.protocol
    assert run.metadata.load.mass == plan.loads
    nodes, level = course(plan, Thermal(ROOM, heating=4.0, cooling=1 / 48.0), 400)
    assert run.duration == pytest.approx(nodes[-1], rel=0.25)
    assert np.max(run.table["temperature_a"]) == pytest.approx(np.max(level), abs=8.0)
