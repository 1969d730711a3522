"""Boards and meter are found by what they answer."""

import pytest
from fake_bench import FakeBench, FakeBoard, FakeLine

from muscle_bayes.bench.boards.ports import PortError, PortFinder
from muscle_bayes.bench.boards.protocol import Role
from muscle_bayes.bench.boards.transport import TransportError
from muscle_bayes.bench.meters.meter import Meter


class Mute(FakeLine):
    """A port on which something else hangs."""

    def received(self, data):
        pass


class Machine:
    """A machine with ports, all on one fake bench's clock."""

    def __init__(self, monkeypatch, **lines):
        self.bench = FakeBench()
        self.lines = {
            "sensor": self.bench.sensor,
            "heater": self.bench.heater,
            "meter": self.bench.meter,
            "mute": Mute(),
        } | lines
        self.opened = []
        self.ports = sorted(self.lines)
        # A thread of its own would wait in real time, which does not pass here.
        monkeypatch.setattr("muscle_bayes.bench.boards.ports.ThreadedMeter", lambda meter: meter)

    def open(self, url):
        self.opened.append(url)
        if url not in self.lines:
            raise TransportError(f"{url}: cannot be opened.")
        return self.lines[url]

    def board(self, url):
        line = self.open(url)
        return line if isinstance(line, FakeBoard) else Mute()

    def meter(self, url):
        line = self.open(url)
        return line if line is self.bench.meter else Mute()

    def finder(self, boards=(), meter=None):
        return PortFinder(boards, meter, self.bench.clock, self.board, self.meter, self.listed)

    def listed(self):
        return self.ports


@pytest.fixture
def machine(monkeypatch):
    return Machine(monkeypatch)


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
    with pytest.raises(PortError, match=r"no heater board was found \(mute: no board; sensor: a"):
        machine.finder().devices().open()


def test_no_port_at_all(machine):
    machine.ports = []
    with pytest.raises(PortError, match="there is no port"):
        machine.finder().devices().open()


def test_no_meter(machine):
    machine.ports.remove("meter")
    with pytest.raises(PortError, match=r"no meter was found \(mute: no meter\).*--meter"):
        machine.finder().devices().open()


def test_given_port_tells_why(machine):
    with pytest.raises(PortError, match=r"nowhere: cannot be opened.*no answer to ID"):
        machine.finder(("nowhere", "mute")).devices().open()
