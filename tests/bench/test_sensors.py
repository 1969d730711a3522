"""Sensors of the boards' own: what their words mean, what they trip, what is recorded from them."""

import numpy as np
import pandas as pd
import pytest
from host_firmware import HostFirmware
from hypothesis import given
from hypothesis import strategies as st
from simulated_ports import Ports
from typer.testing import CliRunner

from benchmarks.bench_test.host import HeatingHost
from muscle_bayes.bench.boards.board import Board
from muscle_bayes.bench.boards.messages import Fault, ResetCause, Role
from muscle_bayes.bench.boards.protocol import Error
from muscle_bayes.bench.meters.board_meter import BoardMeter
from muscle_bayes.bench.meters.meter import first_reading
from muscle_bayes.bench.recording.loop import RecordingError
from muscle_bayes.bench.recording.session import Session
from muscle_bayes.bench.sensors.catalogue import (
    SENSORS,
    THERMOMETERS,
    Wiring,
    names_of,
    thermometer_of,
    wiring_of,
)
from muscle_bayes.bench.sequences.sequence import Sequence, Stage
from muscle_bayes.bench.simulation import SimulatedBench, TwinPlant
from muscle_bayes.bench.simulation.chips import (
    ENCODER_SCALE,
    max6675_word,
    max31855_word,
    thermistor_counts,
)
from muscle_bayes.bench.simulation.recording import (
    SimulatedOperator,
    rig_tables,
    simulated_devices,
)
from muscle_bayes.cli import app
from muscle_bayes.data import read_run
from muscle_bayes.errors import MuscleBayesError

MAX31855, MAX6675, THERMISTOR = 1, 2, 3
NO_READING = -32768
BETA, RATIO = 3950, 1.0
WIRED = {"max31855": (1, 1), "max6675": (2, 2), "thermistor": (3, 3)}


@pytest.fixture
def board(firmware):
    return HostFirmware(firmware)


def wire(board, kind):
    (answer, *_) = board.ask("INPUT", kind, kind, 0, 0, 0, BETA, 1000)
    assert not isinstance(answer, Error)


@given(st.floats(-20.0, 200.0))
def test_a_chips_word_is_its_temperature(firmware, temperature):
    board = HostFirmware(firmware)
    for kind, word in ((MAX31855, max31855_word), (MAX6675, max6675_word)):
        shown, sense = board.thermometer(kind, word(max(temperature, 1.0)))
        assert sense
        assert shown / 10 == pytest.approx(max(temperature, 1.0), abs=0.18)  # a quarter, in tenths
    below, sense = board.thermometer(MAX31855, max31855_word(temperature))
    assert sense
    assert below / 10 == pytest.approx(temperature, abs=0.18)


@given(st.floats(-10.0, 130.0))
def test_a_thermistors_conversions_are_its_temperature(firmware, temperature):
    board = HostFirmware(firmware)
    total = round(8 * thermistor_counts(temperature, BETA, RATIO))
    shown, sense = board.thermometer(THERMISTOR, total)
    assert sense
    assert shown / 10 == pytest.approx(temperature, abs=0.2)


@pytest.mark.parametrize(
    ("kind", "word"),
    [
        (MAX31855, max31855_word(None)),
        (MAX31855, max31855_word(25.0) | 1 << 16 | 2),  # shorted to ground
        (MAX31855, max31855_word(25.0) | 1 << 16 | 4),  # shorted to the supply
        (MAX6675, max6675_word(None)),
        (THERMISTOR, 8 * 1023),  # torn
        (THERMISTOR, 0),  # shorted
    ],
)
def test_a_broken_thermometer_is_none_at_once(board, kind, word):
    assert board.thermometer(kind, word) == (NO_READING, True)


@pytest.mark.parametrize(
    ("kind", "word"),
    [
        (MAX31855, 0),  # a line that is held down
        (MAX31855, 0xFFFFFFFF),  # no chip: the pull-up
        (MAX31855, max31855_word(25.0) | 8),
        (MAX6675, 0),
        (MAX6675, 0xFFFF),
        (THERMISTOR, 0xFFFF),  # conversions that do not agree
    ],
)
def test_nonsense_is_forgiven_once(board, kind, word):
    assert board.thermometer(kind, word)[1] is False
    wire(board, kind)
    board.looked(0, sound(kind, 25.0))
    board.looked(1, sound(kind, 25.0))
    board.ask("DUTY", 99, 0, None, None)
    for looks in (word, sound(kind, 25.3), word):
        board.looked(0, looks)
        assert board.duties[0] == 99
    board.looked(0, word)
    assert board.faults == Fault.SENSOR


def sound(kind, temperature):
    if kind == THERMISTOR:
        return round(8 * thermistor_counts(temperature, BETA, RATIO))
    return (max31855_word if kind == MAX31855 else max6675_word)(temperature)


@pytest.mark.parametrize("kind", [MAX31855, MAX6675, THERMISTOR])
def test_over_temperature_trips_at_once_and_without_a_host(board, kind):
    wire(board, kind)
    board.looked(0, sound(kind, 90.0))
    assert not board.faults
    board.looked(0, sound(kind, 111.0))
    assert board.faults == Fault.OVER_TEMPERATURE
    assert Error(1, "FAULT") in board.ask("CLEAR")
    for temperature in (108.0, 104.0):
        board.looked(0, sound(kind, temperature))
    board.ask("CLEAR")
    assert not board.faults


def test_no_heat_before_a_thermometer_has_told_something(board):
    wire(board, MAX31855)
    board.ask("DUTY", 200, 200, None, None)
    assert board.duties == (0, 0)
    assert not board.faults
    board.old(3, 6, 200)
    assert board.duties == (0, 0)


def test_the_host_cannot_stand_in_for_a_thermometer_of_the_board(board):
    wire(board, MAX31855)
    board.calibrate(0, 450, 480)
    for channel in range(2):
        board.looked(channel, max31855_word(25.0))
    for ms in range(0, 8000, 100):
        board.ask("DUTY", 255, 0, 250 + ms // 20, 250)  # the host says that it warms
        board.looked(0, max31855_word(25.0))
        board.tick(100)
    assert board.faults == Fault.SENSOR


def test_a_driver_that_stops_is_noticed(board):
    wire(board, MAX31855)
    for channel in range(2):
        board.looked(channel, max31855_word(25.0))
    for _ in range(5):
        board.ask("DUTY", 50, 0, None, None)
        board.tick(100)
    assert board.faults == Fault.SENSOR


def test_looks_are_as_far_apart_as_conversions_take(board):
    for kind, period in ((MAX31855, 112), (MAX6675, 224)):
        wire(board, kind)
        when = [[], []]
        for ms in range(1000):
            board.tick()
            for channel in range(2):
                if board.looks >> channel & 1:
                    when[channel].append(ms)
                    board.looked(channel, sound(kind, 25.0))
        for times in when:
            assert set(np.diff(times)) == {period}


@pytest.mark.parametrize(
    ("heater", "wiring"),
    [(True, (0, 0, 1, 0, 0)), (True, (0, 0, 0, 0, 1)), (False, (1, 0, 0, 0, 0))],
)
def test_an_input_belongs_to_its_board(firmware, heater, wiring):
    board = HostFirmware(firmware, heater=heater)
    assert board.ask("INPUT", *wiring, BETA, 1000) == [Error(1, "ROLE")]


def test_no_input_is_changed_while_a_heater_is_on(board):
    board.ask("DUTY", 10, 0, 250, 250)
    assert board.ask("INPUT", 1, 1, 0, 0, 0, BETA, 1000) == [Error(1, "HEAT")]


@pytest.mark.parametrize(
    "mixed", [Wiring(thermometer_a=1), Wiring(thermometer_a=1, thermometer_b=3)]
)
def test_a_mix_of_thermometers_is_refused_in_words(mixed):
    with pytest.raises(MuscleBayesError, match=r"(?s)different kinds.*Fix: .*--none"):
        thermometer_of(mixed)


def test_names_and_wiring_are_one():
    for name, sensor in SENSORS.items():
        wiring = wiring_of([name], sensor.role)
        assert names_of(wiring) == (name,)
        other = Role.SENSOR if sensor.role is Role.HEATER else Role.HEATER
        assert wiring_of([name], other) == Wiring()
    with pytest.raises(MuscleBayesError, match="place is taken"):
        wiring_of(["max31855", "max6675"], Role.HEATER)
    with pytest.raises(MuscleBayesError, match=r"'x' is no sensor\. Fix"):
        wiring_of(["x"], Role.HEATER)


# On the simulated board.


@pytest.mark.parametrize("name", THERMOMETERS)
def test_the_board_reads_its_thermometers(firmware, name):
    with SimulatedBench(seed=3, sensors=[name]) as bench:
        bench.thermometers.shows = lambda time, true: (31.0, 47.5)
        devices = simulated_devices(bench)
        devices.open()
        bench.clock.sleep(1.5)
        assert isinstance(devices.meter.device, BoardMeter)
        reading = first_reading(devices.meter.device, bench.clock, 1.0)
        assert reading.temperatures == pytest.approx((31.0, 47.5), abs=0.45)


@pytest.mark.parametrize("name", ["max31855", "max6675"])
@pytest.mark.parametrize("shown", [(31.25, 47.75), (20.5, 99.0)])
def test_quarters_of_a_degree_come_through_whole(firmware, name, shown):
    """The board tells tenths, and rounds quarters up and down by turns."""
    with SimulatedBench(seed=3, sensors=[name]) as bench:
        bench.thermometers.forced = shown
        devices = simulated_devices(bench)
        devices.open()
        bench.clock.sleep(1.5)
        assert first_reading(devices.meter.device, bench.clock, 1.0).temperatures == shown


@pytest.mark.parametrize("name", THERMOMETERS)
def test_an_old_script_is_switched_off_by_the_boards_own_thermometer(firmware, name):
    with SimulatedBench(seed=4, sensors=[name]) as bench:
        bench.clock.sleep(0.5)
        answer_old(bench, 3, 6, 120)
        assert bench.heater.duties == (120, 0)
        bench.thermometers.forced = (112.5, None)
        struck, off = bench.clock.now(), None
        while off is None and bench.clock.now() - struck < 1.0:
            answer_old(bench, 3, 6, 120)
            off = bench.clock.now() if bench.heater.duties == (0, 0) else None
        assert off is not None
        assert off - struck <= 0.5


def answer_old(bench, *numbers):
    for number in numbers:
        bench.clock.sleep(0.004)
        bench.heater_board.write(str(number).encode())
        bench.clock.sleep(0.006)


def test_a_damaged_wiring_gives_no_heat(firmware):
    with SimulatedBench(seed=5, sensors=["max31855"]) as bench:
        bench.heater.write_eeprom(32, b"\x01\x02\x00")
        bench.clock.sleep(0.5)
        board = Board(bench.heater_board, bench.clock)
        board.identify()
        assert board.wiring() == Wiring()
        board.command_duty(200, 0, None, None)
        bench.clock.sleep(0.05)
        assert bench.heater.duties == (0, 0)


def test_the_fan_cools(firmware):
    falls = []
    for fan in (False, True):
        with SimulatedBench(seed=6) as bench:
            host = HeatingHost(bench, (70.0, 70.0))
            host.run(20.0)
            before = bench.plant.temperatures()[0]
            host.board.command_fan(fan)
            host.board.off()
            bench.clock.sleep(10.0)
            falls.append(before - bench.plant.temperatures()[0])
    assert falls[1] > 1.8 * falls[0]


def test_a_tube_that_a_fan_cools_is_no_broken_sensor(firmware):
    with SimulatedBench(seed=7) as bench:
        host = HeatingHost(bench, (40.0, 40.0))
        host.board.command_fan(True)
        host.heating.fan = True
        host.run(60.0)
        assert host.stopped is None
        assert bench.plant.temperatures() == pytest.approx((40.0, 40.0), abs=1.0)


STAGES = (
    Stage(duration=4.0),
    Stage(setpoint_a=60.0, duration=15.0),
    Stage(load=0.166, duration=8.0),
)


def recorded(folder, sensors, stages=STAGES, before=lambda bench: None, seed=8):
    """The run that a session makes of these stages, and the plant's angle at its end [rad]."""
    plant = TwinPlant(load=0.139, seed=seed)
    with SimulatedBench(plant, seed, sensors=sensors) as bench:
        devices = simulated_devices(bench)
        operator = SimulatedOperator(bench, 0.139)
        session = Session(
            Sequence(load=0.139, stage=stages),
            folder / "seq.toml",
            folder / "runs",
            devices,
            operator,
            origin="synthetic",
            rig=rig_tables(plant.rig, bench),
            load=0.139,
        )
        devices.open()
        if "encoder" in sensors:
            devices.sensor.device.encoder_marked(mark=True)
        before(bench)
        list(session.record())
        return read_run(folder / "runs" / "seq.csv"), plant.angle


def test_an_encoder_gives_the_angle(firmware, tmp_path):
    run, angle = recorded(tmp_path, ["encoder"])
    assert run.metadata.potentiometer.bits == 16
    assert np.all(run.table["reading"] % 1 == 0)
    assert run.coordinate[-1] == pytest.approx(angle, abs=3 * ENCODER_SCALE)
    assert np.ptp(run.coordinate) > 20 * ENCODER_SCALE


def test_an_encoder_whose_zero_is_lost_ends_the_run(firmware, tmp_path):
    def reset_later(bench):
        bench.listeners.append(lambda ms: bench.sensor_board.plug() if ms == 12_000 else None)

    with pytest.raises(RecordingError, match="encoder has lost its zero"):
        recorded(tmp_path, ["encoder"], before=reset_later)


def test_an_encoder_that_lost_power_has_to_be_calibrated(firmware, tmp_path):
    def cut(bench):
        bench.sensor.reset(ResetCause.POWER_ON)
        bench.clock.sleep(0.2)

    with pytest.raises(RecordingError, match=r"encoder has lost its zero.*calibrate"):
        recorded(tmp_path, ["encoder"], before=cut)


def test_opening_a_port_keeps_an_encoders_count(firmware):
    plant = TwinPlant(load=0.139, seed=9)
    with SimulatedBench(plant, 9, sensors=["encoder"]) as bench:
        bench.clock.sleep(0.2)
        board = Board(bench.sensor_board, bench.clock)
        board.identify()
        plant.turn(0.6)
        bench.clock.sleep(15.0)  # until it rests, elsewhere than before
        board.encoder_marked(mark=True)
        before = board.request("READ")[1]
        assert abs(before - 8 * 32768) > 40
        bench.sensor_board.plug()
        bench.clock.sleep(0.2)
        assert board.request("READ")[1] == pytest.approx(before, abs=16)
        assert board.encoder_marked()


def test_a_load_cell_weighs_what_hangs(firmware, tmp_path):
    run, _ = recorded(tmp_path, ["hx711"])
    load = run.metadata.load
    assert load.mass == pytest.approx((0.139, 0.166), abs=2e-4)
    assert load.mass != (0.139, 0.166)  # measured, not asked for


def test_a_load_that_is_not_the_one_asked_for_is_told(firmware, tmp_path):
    def swap(bench):
        bench.plant.hang(0.180)

    run, _ = recorded(tmp_path, ["hx711"], (Stage(duration=6.0),), before=swap)
    assert run.metadata.load.mass == pytest.approx((0.180,), abs=2e-4)
    assert "asked for 139 g" in run.metadata.notes


def test_a_second_potentiometer_is_logged_beside_the_first(firmware, tmp_path):
    recorded(tmp_path, ["potentiometer-2"])
    path = tmp_path / "runs" / "seq.csv"
    table = pd.read_csv(path, skipinitialspace=True)
    apart = table["Potentiometer Reading"] - table["Reading 2"]
    assert apart.mean() == pytest.approx(30.0, abs=2.5)
    assert apart.std() < 0.5


def test_the_command_tells_both_boards(firmware):
    with SimulatedBench(seed=1) as bench, Ports(bench) as ports:
        lines = ["--port", ports.sensor_board, "--port", ports.heater_board]
        for names, heater, sensor in (
            ([], "nothing more", "nothing more"),
            (["max6675", "encoder", "hx711"], "max6675", "encoder, hx711"),
            ([], "max6675", "encoder, hx711"),
            (["--none"], "nothing more", "nothing more"),
        ):
            told = CliRunner().invoke(app, ["sensors", *names, *lines])
            assert told.output == f"heater board: {heater}\nsensor board: {sensor}\n"
        assert CliRunner().invoke(app, ["sensors", "max6675", "thermistor"]).exit_code == 2
    listed = CliRunner().invoke(app, ["sensors", "--list"]).output
    assert all(f"{name}:" in listed for name in SENSORS)
