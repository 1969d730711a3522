"""Help, examples, exit codes and places of results, of every command."""

import shlex

import pytest
import typer
from typer.testing import CliRunner

from muscle_bayes.cli import GROUPS, app
from muscle_bayes.cli.common import EXIT_CODES, writable_file, writable_folder

COMMANDS = typer.main.get_command(app).commands  # type: ignore[attr-defined]
each = pytest.mark.parametrize("name", sorted(COMMANDS))
# Options that name a file to be read, or that print where nothing is given.
WRITTEN = {"out", "json", "header", "figure", "truth"}


def examples(name: str) -> list[list[str]]:
    lines = COMMANDS[name].epilog.split("Exit codes")[0].splitlines()[1:]
    return [shlex.split(line.replace("\\[", "[")) for line in lines if line.strip()]


@each
def test_help_shows_two_examples_that_are_taken_and_the_exit_codes(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shown = examples(name)
    assert len(shown) >= 2
    for program, command, *arguments in shown:
        assert (program, command) == ("muscle-bayes", name)
        COMMANDS[name].make_context(name, arguments)  # raises on options that are none
    told = CliRunner().invoke(app, [name, "--help"], env={"COLUMNS": "200", "TERM": "dumb"})
    assert told.exit_code == 0
    assert EXIT_CODES in told.output


RIGS = {
    "hold": "Tables of the joint, as in NAME.toml; required with --real.",
    "track": "Tables of the joint, as in NAME.toml; required with --real.",
    "calibrate": "Rig whose endstops are used: the tables of any run's NAME.toml.",
}


@pytest.mark.parametrize("name", RIGS)
def test_help_of_a_rig_names_what_the_command_has(name):
    assert RIGS[name] in [one.help for one in COMMANDS[name].params if one.name == "rig"]


def test_every_command_is_in_a_group():
    grouped = [one.__name__.replace("_", "-") for commands in GROUPS.values() for one in commands]
    assert sorted(grouped) == sorted(COMMANDS)


@each
def test_places_of_results_are_tested_before_anything_is_computed(name):
    for option in COMMANDS[name].params:
        if option.name in WRITTEN:
            assert option.callback is not None, option.name
            assert option.callback.__wrapped__ in (writable_file, writable_folder), option.name


@pytest.mark.parametrize("option", ["--out", "--json"])
@pytest.mark.parametrize("place", ["{}/file.txt/x/r.nc", "/proc/r.nc", "{}"])
def test_a_place_that_cannot_be_written_is_refused_at_once(tmp_path, option, place):
    (tmp_path / "file.txt").write_text("")
    target = place.format(tmp_path)
    other = [] if option == "--out" else ["--out", str(tmp_path / "r.nc")]
    told = CliRunner().invoke(app, ["fit", "no-such-run.csv", option, target, *other])
    assert told.exit_code == 2
    assert f"{option} {target}: cannot be written" in told.stderr
    assert "Fix:" in told.stderr
    assert [one.name for one in tmp_path.iterdir()] == ["file.txt"]


def test_interruption_ends_with_130_and_one_line(monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("muscle_bayes.data.find_runs", interrupt)
    told = CliRunner().invoke(app, ["inspect", "data"])
    assert told.exit_code == 130
    assert told.stderr == "Interrupted.\n"


@pytest.mark.parametrize(
    ("arguments", "wanted"),
    [
        (["inspekt", "data"], "inspect"),
        (["effects", "coil-contcat"], "Did you mean 'coil-contact'?"),
        (["inspect", "data/sawtoth.csv"], "Did you mean 'sawtooth.csv'?"),
        (["check", "no.nc", "data"], "there is no such file"),
        (["show", "data/spring-1.csv"], "is not a NetCDF file. Fix: name a posterior that"),
        (
            ["tune", "data/spring-1.csv", "--out", "no.toml"],
            "is not a NetCDF file. Fix: name a posterior that",
        ),
        (
            ["track", "foo", "--out", "no-folder"],
            "SCENARIO foo is not known. Fix: use a file, or one of ",
        ),
    ],
)
def test_a_mistake_ends_with_2_and_says_what_was_meant(arguments, wanted):
    told = CliRunner().invoke(app, arguments)
    assert told.exit_code == 2
    assert wanted in told.stderr
