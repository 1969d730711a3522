"""`muscle-bayes flash`: avrdude's call, boards that cannot run it, and what its failures mean."""

import json
import runpy
import shutil
import stat
import subprocess
from pathlib import Path

import pytest
from serial.tools.list_ports_common import ListPortInfo
from typer.testing import CliRunner

from muscle_bayes.bench.boards import flashing
from muscle_bayes.bench.boards.flashing import (
    BAUDS,
    SHIPPED,
    check_program,
    choose_port,
    find_avrdude,
    flash,
    refuse_unfit,
)
from muscle_bayes.bench.boards.messages import VERSION
from muscle_bayes.cli import app
from muscle_bayes.errors import MuscleBayesError

PROJECT = Path(__file__).parents[2]


def port(device, vendor, product):
    """A port as pyserial lists it."""
    made = ListPortInfo(device)
    made.vid, made.pid = vendor, product
    return made


UNO = port("/dev/ttyACM0", 0x2341, 0x0043)
CLONE = port("/dev/ttyUSB0", 0x1A86, 0x7523)
LEONARDO = port("/dev/ttyACM1", 0x2341, 0x8036)
MODEM = port("/dev/ttyUSB9", 0x1234, 0x5678)


def avrdude(*outcomes):
    """A fake that ends with these outcomes by turns: None = well, or its words."""
    calls = []

    def run(command):
        words = outcomes[len(calls)]
        calls.append(command)
        return subprocess.CompletedProcess(command, int(words is not None), "", words or "")

    return run, calls


def test_an_uno_is_loaded_at_the_first_rate():
    run, calls = avrdude(None)
    assert flash(UNO, Path("x.hex"), Path("/bin/avrdude"), run=run) == BAUDS[0]
    (command,) = calls
    text = " ".join(command)
    assert text.startswith("/bin/avrdude -p atmega328p -c arduino -P /dev/ttyACM0 -b 115200 -D")
    assert command[-1] == "flash:w:x.hex:i"


def test_an_older_boot_loader_is_tried_at_the_second_rate():
    run, calls = avrdude("stk500_recv(): programmer is not responding", None)
    assert flash(CLONE, Path("x.hex"), Path("a"), run=run) == BAUDS[1]
    assert [command[command.index("-b") + 1] for command in calls] == ["115200", "57600"]


@pytest.mark.parametrize(
    ("words", "says", "tries"),
    [
        (
            "Device signature = 0x1e9801\nExpected signature",
            "another processor.*signature 1e9801",
            1,
        ),
        ("Device signature = 1E 98 01 (probably m2560)", "another processor", 1),
        ("can't open device: Permission denied", "usermod -aG dialout", 1),
        ('cannot open port "COM7": Access is denied', "close other programs", 1),
        ("can't open device: No such file or directory", "no such port", 1),
        ("not in sync: resp=0x00", "no boot loader answers.*CH340", 2),
        ("Device signature = 0x1e950f\nverification error", "verification error", 1),
        ("", "says nothing", 1),
    ],
)
def test_what_avrdude_says_is_explained(words, says, tries):
    run, calls = avrdude(words, words)
    with pytest.raises(MuscleBayesError, match=f"(?s){says}"):
        flash(UNO, Path("x.hex"), Path("a"), run=run)
    assert len(calls) == tries


@pytest.mark.parametrize("kind", flashing.UNFIT)
def test_boards_that_cannot_run_it_are_refused_before_anything(kind):
    run, calls = avrdude()
    with pytest.raises(MuscleBayesError, match="runs on an ATmega328P"):
        flash(port("p", *kind), Path("x.hex"), Path("a"), run=run)
    assert calls == []


def test_no_kind_is_in_two_lists():
    lists = (flashing.FIT, flashing.UNFIT)
    assert sum(map(len, lists)) == len({kind for kinds in lists for kind in kinds})
    assert refuse_unfit(MODEM) == refuse_unfit(ListPortInfo("/dev/ttyS0")) == "unknown board"


def test_the_only_board_is_chosen():
    assert choose_port([MODEM, CLONE], None) == CLONE
    assert choose_port([MODEM, CLONE], MODEM.device) == MODEM
    assert choose_port([], "COM3") == ListPortInfo("COM3")
    with pytest.raises(MuscleBayesError, match="/dev/ttyACM0, /dev/ttyUSB0"):
        choose_port([UNO, CLONE], None)
    with pytest.raises(MuscleBayesError, match="Leonardo"):
        choose_port([LEONARDO], None)
    with pytest.raises(MuscleBayesError, match="meant: none"):
        choose_port([MODEM], None)


def executable(path):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def test_avrdude_is_found_or_explained(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    with pytest.raises(MuscleBayesError, match=r"avrdude is missing.*apt install.*brew.*winget"):
        find_avrdude()
    tools = tmp_path / ".arduino15/packages/arduino/tools/avrdude"
    executable(tools / "6.3.0/bin/avrdude_bin")
    brought = executable(tools / "6.3.0/bin/avrdude")
    assert find_avrdude() == brought
    own = executable(tmp_path / "bin" / "avrdude")
    assert find_avrdude() == own


def test_the_shipped_program_is_that_of_the_sources(firmware):
    ship = runpy.run_path(str(firmware.parent / "ship.py"))
    assert ship["digest"]() in SHIPPED.with_suffix(".json").read_text(), (
        "run `make -C firmware ship`"
    )
    assert check_program() == f"firmware {VERSION}, protocol {VERSION}"
    assert SHIPPED.stat().st_size < 100_000


def test_the_shipped_program_is_what_the_compiler_makes(tmp_path):
    if shutil.which("avr-gcc") is None:
        pytest.skip(
            "no avr-gcc here: the shipped program is compared with its sources' checksum only"
        )
    ship = runpy.run_path(str(PROJECT / "firmware" / "ship.py"))
    compiler, shipped = ship["compiler"](), json.loads(SHIPPED.with_suffix(".json").read_text())
    if compiler != shipped["compiler"]:
        pytest.skip(f"shipped by {shipped['compiler']!r}, here is {compiler!r}")
    program = tmp_path / "muscle_bench.hex"
    make = ["make", "-s", "-C", PROJECT / "firmware", f"BUILD={tmp_path}", program]
    subprocess.run(make, check=True, capture_output=True)
    assert program.read_bytes() == SHIPPED.read_bytes()


def test_a_damaged_program_is_not_loaded(tmp_path):
    path = tmp_path / "muscle_bench.hex"
    with pytest.raises(MuscleBayesError, match="missing"):
        check_program(path)
    path.write_bytes(SHIPPED.read_bytes()[:-20])
    path.with_suffix(".json").write_bytes(SHIPPED.with_suffix(".json").read_bytes())
    with pytest.raises(MuscleBayesError, match="damaged"):
        check_program(path)


def test_the_command_refuses_in_one_line(monkeypatch):
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [LEONARDO])
    told = CliRunner().invoke(app, ["flash"])
    assert told.exit_code == 2
    assert "Arduino Leonardo" in told.output
    told = CliRunner().invoke(app, ["flash", "--hex", "none.hex"])
    assert told.exit_code == 2
    assert "no such file" in told.output
