"""What docs/bench.md shows is what the program takes."""

import re
from pathlib import Path

from typer.testing import CliRunner

from benchmarks.bench_test import overheating
from benchmarks.bench_test.stuck_meter import MOST_EXCESS
from muscle_bayes.bench.heat import heat_model, thermometry
from muscle_bayes.bench.heat.thermometry import NEAR
from muscle_bayes.bench.meters.meter import Meter
from muscle_bayes.bench.recording.recorder import UNCALIBRATED_RISE
from muscle_bayes.bench.sequences.sequence import Limits
from muscle_bayes.bench.sequences.sequence_file import parse_sequence
from muscle_bayes.cli import app

DOCS = Path(__file__).parents[2] / "docs" / "bench.md"


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", DOCS.read_text(), re.DOTALL)


def test_the_sequence_shown_is_one():
    (shown,) = blocks("toml")
    sequence = parse_sequence(shown.encode(), DOCS)
    (run,) = sequence.runs("shown")
    assert len(run.once_through()) == 4
    defaults = Limits()
    for key in ("stage_timeout", "reconnect_time", "operator_timeout"):
        assert getattr(sequence.limits, key) == getattr(defaults, key)


def test_the_commands_shown_exist_with_their_options():
    lines = [line for block in blocks("sh") for line in block.splitlines()]
    shown = [line.split("#")[0].split() for line in lines if line.startswith("muscle-bayes ")]
    assert len(shown) >= 5
    for _, command, *words in shown:
        told = CliRunner().invoke(app, [command, "--help"], env={"COLUMNS": "200"})
        assert told.exit_code == 0
        assert all(word in told.output for word in words if word.startswith("--"))


def test_the_times_for_which_heat_goes_on_are_those_of_the_code():
    text = " ".join(DOCS.read_text().split())
    for told in (
        f"from {thermometry.ANSWERED_WITHIN:g} s after its last answer",
        f"no rows after {thermometry.SILENT_AFTER:g} s",
        f"more than {thermometry.FAR:g} C below its setpoint",
        f"after {Meter.moved_within:g} s of that since they changed",
        f"when {thermometry.UNPROVEN / 255:.1f} s of full power",
        f"stuck after {thermometry.STUCK_AFTER:g} s of waiting",
        f"ends after {heat_model.HOST_MUST_SHOW:g} C by the heat model",
        f"may be above {heat_model.HOTTEST:g} C, whatever is shown",
        f"after about {heat_model.MUST_SHOW:g} C of heat",
        f"comes above {overheating.HOTTEST:g} C",
        f"{UNCALIBRATED_RISE:g} C above the room, and `record` refuses more",
        f"more than {NEAR:g} C off the room",
        f"more than {MOST_EXCESS:g} C above",
    ):
        assert told in text
