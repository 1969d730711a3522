"""The simulated bench against closed forms, against itself, and against its stated faults."""

import math
import re
import time

import numpy as np
import pytest
from simulated_ports import Ports

from muscle_bayes.bench.boards.board import SILENCE_LIMIT, Board, BoardError
from muscle_bayes.bench.boards.clock import RealClock
from muscle_bayes.bench.boards.messages import Fault, ResetCause, Role
from muscle_bayes.bench.boards.protocol import Boot, FaultReport, Sample, encode
from muscle_bayes.bench.boards.transport import SerialTransport, TransportError, meter_transport
from muscle_bayes.bench.meters.meter import REQUEST, Meter, first_reading, parse_answer
from muscle_bayes.bench.simulation import SimulatedBench, TwinPlant
from muscle_bayes.bench.simulation.links import Link
from muscle_bayes.bench.simulation.meter import MeterEmulator
from muscle_bayes.bench.simulation.processor import Processor
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin import Meter as MeterModel
from muscle_bayes.twin import Rig

pytestmark = pytest.mark.usefixtures("firmware")


@pytest.fixture
def bench():
    with SimulatedBench(seed=3) as bench:
        yield bench


def hold(bench, board, seconds, first, second):
    """Command the same duties for some time."""
    end = bench.clock.now() + seconds - 1e-9
    while bench.clock.now() < end:
        board.command_duty(first, second, 25.0 + bench.clock.now(), 25.0)
        bench.clock.sleep(0.03)
        board.poll()


def test_duty_heats_the_plant_as_newtons_law_says(bench):
    heater = Rig().heater
    board = Board(bench.heater_board, bench.clock)
    board.identify()
    hold(bench, board, 20.0, 100, 0)
    final = bench.plant.temperatures()
    settled = 25.0 + heater.full_rate * heater.cooling_time * 100 / 255
    expected = settled + (25.0 - settled) * math.exp(-20.0 / heater.cooling_time)
    assert final[0] == pytest.approx(expected, abs=0.02)  # the first command takes 4 ms
    assert final[1] == 25.0


def test_the_angle_reaches_the_sensor_board(bench):
    board = Board(bench.sensor_board, bench.clock)
    board.identify()
    assert isinstance(bench.plant, TwinPlant)
    for angle in (-1.0, 0.0, 0.7):
        bench.plant.turn(angle)
        bench.clock.sleep(0.012)
        _, counts, *_ = board.request("READ")
        rotor = bench.plant.bench.rotor.angle
        assert counts / 8 == pytest.approx(bench.plant.zero_reading + rotor / 0.0058, abs=3)


def test_equal_seeds_give_equal_bytes_and_others_do_not():
    def play(seed):
        with SimulatedBench(seed=seed) as bench:
            bench.sensor_board.write(encode(1, "STREAM", 5))
            bench.clock.sleep(0.2)
            bench.sensor_board.write(encode(1, "STREAM", 5))
            bench.heater_board.write(encode(2, "DUTY", 200, 100, 250, 250))
            heard = []
            for _ in range(300):
                bench.clock.sleep(0.01)
                bench.meter.write(REQUEST)
                heard += [link.read(4096) for link in (bench.sensor_board, bench.meter)]
            return heard, bench.plant.temperatures()

    assert play(1) == play(1)
    assert play(1)[0] != play(2)[0]


def test_time_passes_in_whole_steps_however_it_is_cut(bench):
    for _ in range(1000):
        bench.clock.sleep(0.0003)
    assert bench.clock.now() == pytest.approx(0.3, abs=1e-9)
    assert bench.sensor.cycle == pytest.approx(0.3 * 16e6, abs=16_100)
    bench.clock.sleep(0.0)
    bench.clock.sleep(-1.0)
    assert bench.clock.now() == pytest.approx(0.3, abs=1e-9)


def test_the_meter_answers_in_its_own_time():
    device = MeterEmulator(MeterModel(), np.random.default_rng(0))
    device.step(0.0, (25.0, 30.0))
    device.send(REQUEST[:5])
    device.send(REQUEST[5:])
    device.step(0.02, (25.0, 30.0))
    assert device.receive(100) == b""
    device.step(0.03, (25.0, 30.0))
    answer = device.receive(100)
    assert len(answer) == 14
    assert parse_answer(answer) == pytest.approx((25.0, 30.0), abs=0.3)


def test_the_meters_faults_show(bench):
    meter = Meter(bench.meter, bench.clock)
    assert first_reading(meter, bench.clock, 1.0).temperatures == pytest.approx((25, 25), abs=0.5)
    bench.meter_device.open_channels = (True, False)
    bench.meter_device.forced = (None, 444.4)
    for _ in range(100):
        bench.clock.sleep(0.005)
        meter.poll()
    assert meter.latest.temperatures == (None, 444.4)
    bench.meter_device.silent = True
    bench.clock.sleep(0.1)
    meter.poll()
    last = meter.latest.time
    for _ in range(100):
        bench.clock.sleep(0.005)
        meter.poll()
    assert meter.latest.time == last


def test_a_pulled_cable_raises_and_a_plugged_one_finds_a_board_that_was_reset(bench):
    board = Board(bench.heater_board, bench.clock)
    first = board.identify()
    hold(bench, board, 0.3, 200, 0)
    assert bench.heater.duties == (200, 0)
    bench.heater_board.pull()
    with pytest.raises(BoardError, match="the simulated cable is pulled"):
        board.poll()
    with pytest.raises(TransportError):
        bench.heater_board.write(b"x")
    bench.heater_board.plug()
    second = board.identify()
    assert bench.heater.duties == (0, 0)
    assert second.boot == first.boot + 1
    assert second.cause is ResetCause.EXTERNAL
    assert any(isinstance(message, Boot) for message in board.poll())


def test_a_board_that_says_nothing_more_is_given_up(bench):
    board = Board(bench.heater_board, bench.clock, "heater board")
    board.identify()
    bench.heater_board.deaf = True
    start = bench.clock.now()
    with pytest.raises(BoardError, match="heater board: it owes an answer"):
        hold(bench, board, 5.0, 0, 0)
    assert bench.clock.now() - start == pytest.approx(SILENCE_LIMIT, abs=0.05)


def test_what_is_no_board_is_told_from_one():
    class Silent:
        def send(self, data):
            pass

        def receive(self, max_bytes):
            return b""

    class Old(Silent):
        def receive(self, max_bytes):
            return b"w\r\n"

    with SimulatedBench() as bench:
        with pytest.raises(BoardError, match=r"no answer to ID in 0\.5 s"):
            Board(Link(Silent(), "x"), bench.clock).identify(0.5)
        with pytest.raises(BoardError, match="only the old firmware answers there"):
            Board(Link(Old(), "x"), bench.clock).identify(0.5)


def test_the_board_keeps_what_it_was_told(bench):
    board = Board(bench.heater_board, bench.clock)
    assert board.identify().role is Role.HEATER
    assert board.limit(100, 80.0, 90.0) == (100, 80.0, 90.0)
    hold(bench, board, 0.1, 200, 50)
    assert board.heat is not None
    assert board.heat.duties == (100, 50)
    board.command_duty(50, 50, 90.1, 25.0)
    bench.clock.sleep(0.02)
    assert FaultReport(Fault.OVER_TEMPERATURE) in board.poll()
    assert board.faults is Fault.OVER_TEMPERATURE
    with pytest.raises(BoardError, match="CLEAR was refused"):
        board.clear()
    board.command_duty(0, 0, 40.0, 25.0)
    board.clear()
    assert board.faults == 0
    hold(bench, board, 0.1, 20, 20)
    board.off()
    bench.clock.sleep(0.01)
    assert bench.heater.duties == (0, 0)


def test_requests_survive_a_line_that_loses_every_other_command(bench):
    board = Board(bench.sensor_board, bench.clock)
    board.identify()
    writes = iter(range(10**6))
    bench.sensor_board.garble_to = lambda data: data if next(writes) % 2 else data[:-3] + b"\n"
    for period in (30, 40, 50):
        board.stream(period)
    bench.clock.sleep(0.2)
    assert any(isinstance(message, Sample) for message in board.poll())


def test_a_firmware_that_is_not_built_is_told(monkeypatch, tmp_path):
    monkeypatch.setenv("MUSCLE_BAYES_FIRMWARE", str(tmp_path))
    with pytest.raises(MuscleBayesError, match="the firmware is not built"):
        SimulatedBench()


def test_a_file_that_is_no_firmware_is_told(tmp_path):
    path = tmp_path / "x.elf"
    path.write_text("no elf")
    with pytest.raises(MuscleBayesError, match=re.escape(f"{path}: simavr cannot load it")):
        Processor(heater=True, elf=path)


def test_nothing_is_written_on_stdout(capfd):
    with SimulatedBench() as bench:
        bench.heater.hang(interrupts=False)
        bench.clock.sleep(0.3)
    assert capfd.readouterr() == ("", "")


def test_real_ports_in_real_time():
    """A smoke test: what is tested in virtual time works over serial ports, too."""
    clock = RealClock()
    with SimulatedBench() as bench, Ports(bench) as ports:
        heater = Board(SerialTransport(ports.heater_board), clock, "heater board")
        sensor = Board(SerialTransport(ports.sensor_board), clock, "sensor board")
        meter = Meter(meter_transport(ports.meter), clock)
        assert heater.identify().role is Role.HEATER
        assert sensor.identify().role is Role.SENSOR
        first_reading(meter, clock, 5.0)
        sensor.stream(30)
        end = time.monotonic() + 60.0  # 2 s where the machine is not busy
        samples, confirmed = [], set()
        while (len(samples) <= 60 or (200, 100) not in confirmed) and time.monotonic() < end:
            if heater.faults:  # a machine so busy that the dead-man noticed
                heater.clear()
            heater.command_duty(200, 100, *meter.latest.temperatures)
            heater.poll()
            confirmed.add(heater.heat and heater.heat.duties)
            meter.poll()
            samples += [m for m in sensor.poll() if isinstance(m, Sample)]
            clock.sleep(0.02)
        assert (200, 100) in confirmed
        numbers = [sample.number for sample in samples]
        assert len(numbers) > 60
        assert numbers == list(range(len(numbers)))
        quiet = time.monotonic()
        while not heater.faults and time.monotonic() < quiet + 30.0:
            heater.poll()
            clock.sleep(0.01)
        assert heater.faults == Fault.DEADMAN
        for line in (heater, sensor, meter):
            line.close()
