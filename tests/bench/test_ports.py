"""Boards and meter are found by what they answer."""

from importlib.metadata import EntryPoint

import pytest
from fake_bench import FakeBench, FakeBoard, FakeLine
from typer.testing import CliRunner

from muscle_bayes.bench.boards.messages import Role
from muscle_bayes.bench.boards.ports import PortFinder
from muscle_bayes.bench.boards.transport import TransportError
from muscle_bayes.bench.meters import meter
from muscle_bayes.bench.meters.meter import Meter, MeterError, Reading, first_reading
from muscle_bayes.cli import app
from muscle_bayes.errors import MuscleBayesError


class Mute(FakeLine):
    """A port on which something else hangs."""

    def received(self, data):
        pass


class Machine:
    """A machine with ports, all on one fake bench's clock."""

    def __init__(self, **lines):
        self.bench = FakeBench()
        self.lines = {
            "sensor": self.bench.sensor,
            "heater": self.bench.heater,
            "meter": self.bench.meter,
            "mute": Mute(),
        } | lines
        self.opened = []
        self.ports = sorted(self.lines)

    def open(self, url):
        self.opened.append(url)
        if url not in self.lines:
            raise TransportError(f"{url}: cannot be opened.")
        return self.lines[url]

    def board(self, url):
        line = self.open(url)
        return line if isinstance(line, FakeBoard) else Mute()

    def meter(self, url, clock):
        line = self.open(url)
        return Meter(line if line is self.bench.meter else Mute(), clock)

    def finder(self, boards=(), meter=None):
        return PortFinder(boards, meter, self.bench.clock, self.board, self.meter, self.listed)

    def listed(self):
        return self.ports


@pytest.fixture
def machine():
    return Machine()


def test_all_are_found(machine):
    finder = machine.finder()
    devices = finder.devices()
    devices.open()
    assert finder.in_use == {
        "sensor board": "sensor",
        "heater board": "heater",
        "meter": "meter",
    }
    assert devices.sensor.device.identity.role == Role.SENSOR
    assert devices.heater.device.identity.role == Role.HEATER
    assert isinstance(devices.meter.device, Meter)


def test_given_ports_are_the_only_ones_tried_in_any_order(machine):
    for boards in (("sensor", "heater"), ("heater", "sensor")):
        finder = machine.finder(boards, "meter")
        machine.opened.clear()
        finder.devices().open()
        assert set(machine.opened) == {"sensor", "heater", "meter"}
        assert machine.opened.count("sensor") == 1  # met while the heater board was sought


def test_comes_back_under_another_name(machine):
    finder = machine.finder()
    devices = finder.devices()
    devices.open()
    machine.lines["elsewhere"] = machine.lines.pop("sensor")
    machine.ports = sorted(machine.lines)
    assert finder.board(Role.SENSOR).identity.role == Role.SENSOR
    assert finder.in_use["sensor board"] == "elsewhere"


def test_what_is_missing_is_told(machine):
    del machine.lines["heater"]
    machine.ports = ["mute", "sensor"]
    with pytest.raises(
        MuscleBayesError, match=r"no heater board was found \(mute: no board; sensor: a"
    ):
        machine.finder().devices().open()


@pytest.mark.parametrize(
    ("command", "told"),
    [
        (["sensors"], "tied to GND.\n"),
        (["calibrate", "--stops", "-1.2", "1.2"], "Without a bench, give --simulate.\n"),
    ],
)
def test_without_a_board_only_options_of_the_command_are_named(monkeypatch, command, told):
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 2
    assert result.stderr.endswith(told)


def test_no_port_at_all(machine):
    machine.ports = []
    with pytest.raises(MuscleBayesError, match="there is no port"):
        machine.finder().devices().open()


def test_no_meter(machine):
    machine.ports.remove("meter")
    with pytest.raises(MuscleBayesError, match=r"no meter was found \(mute: no meter\).*--meter"):
        machine.finder().devices().open()


def test_given_port_tells_why(machine):
    with pytest.raises(MuscleBayesError, match=r"nowhere: cannot be opened.*no answer to ID"):
        machine.finder(("nowhere", "mute")).devices().open()


def test_the_heater_boards_own_thermometers_need_no_meter(machine):
    machine.bench.heater.wiring = (1, 1, 0, 0, 0, 3950, 1000)
    machine.bench.heater.own_temperatures = (252, 265)
    finder = machine.finder()
    devices = finder.devices()
    devices.open()
    assert "meter" not in finder.in_use
    meter = devices.meter.device
    assert first_reading(meter, machine.bench.clock, 1.0).temperatures == (25.25, 26.5)


def test_a_board_without_thermometers_is_no_meter(machine):
    with pytest.raises(MeterError, match=r"no thermometers of its own\. Fix"):
        machine.finder(meter="board").devices().open()


def test_a_meter_of_an_installed_package(machine, monkeypatch):
    class Shown:
        garbled, moved_within = 0, 1.0

        def __init__(self, url, clock):
            self.url, self.latest = url, Reading(clock.now(), (20.0, 21.0))

        def poll(self):
            pass

        def close(self):
            pass

    found = EntryPoint("show", "nowhere:Shown", meter.GROUP)
    monkeypatch.setattr(EntryPoint, "load", lambda self: Shown)
    monkeypatch.setattr(meter, "entry_points", lambda group: [found])
    finder = machine.finder(meter="show:/dev/ttyUSB7")
    devices = finder.devices()
    devices.open()
    assert devices.meter.device.url == "/dev/ttyUSB7"
    assert finder.in_use["meter"] == "/dev/ttyUSB7"
    with pytest.raises(MuscleBayesError, match=r"--meter show: no port\. Fix"):
        machine.finder(meter="show").devices().open()
