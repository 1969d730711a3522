"""The heat model: the same on board and host to the last digit, and what it proves."""

import numpy as np
import pytest
from host_firmware import HostFirmware
from hypothesis import given, settings
from hypothesis import strategies as st

from muscle_bayes.bench.boards.messages import Fault
from muscle_bayes.bench.boards.protocol import Decoder, Error, Reply, frame
from muscle_bayes.bench.heat.heat_model import (
    LEAST,
    MOST,
    MOST_RISE,
    MUST_SHOW,
    ROOM,
    STEP_MS,
    HeatModel,
    TubeModel,
)
from muscle_bayes.twin.plant.heater import HeaterTube

TUBE = TubeModel(450, 480)
"""The simulated bench's."""


def states(model):
    return (
        model.most, model.least, model.least_mean, model.shown, model.shown_mean, model.cold,
        model.dose, model.ms,
    )  # fmt: skip


@pytest.fixture
def board(firmware):
    board = HostFirmware(firmware)
    board.calibrate(0, TUBE.gain, TUBE.cooling)
    return board


def give(board, duty, shown, milliseconds):
    """Heat A with a command every 30 ms; the tube's thermocouple shows `shown` [0.1 C]."""
    for start in range(0, milliseconds, 30):
        board.ask("DUTY", duty, 0, shown(start) if callable(shown) else shown, 250)
        board.tick(min(30, milliseconds - start))


@settings(max_examples=40)
@given(
    st.none() | st.tuples(st.integers(100, 1000), st.integers(100, 1000)),
    st.lists(
        st.tuples(st.integers(0, 255), st.integers(-50, 1000), st.integers(1, 390)), max_size=40
    ),
)
def test_host_and_board_agree_to_the_last_digit(firmware, tube, history):
    board = HostFirmware(firmware)
    model = HeatModel(None if tube is None else TubeModel(*tube))
    if tube is not None:
        board.calibrate(0, *tube)
    for duty, shown, milliseconds in history:
        board.ask("DUTY", duty, 0, shown, 250)
        model.report(shown / 10)
        for _ in range(milliseconds):
            given_now = board.duties[0]
            board.tick()
            model.advance(given_now)
        assert board.thermal(0) == states(model)
        if model.unseen() or model.above(MOST_RISE):
            assert board.faults
            return


@pytest.mark.parametrize("duty", [30, 127, 255])
def test_it_follows_a_tube(duty):
    tube, model = HeaterTube(4.5, 48.0, ROOM), HeatModel(TUBE)
    for number in range(3000):
        wanted = duty if number % 500 < 250 else 0
        tube.advance(wanted, 0.03)
        model.advance(wanted, 30)
        assert model.highest_rise == pytest.approx(tube.temperature - ROOM, abs=0.2)
        assert model.least == model.most


def test_one_long_step_is_many_short_ones():
    at_once, by_and_by = HeatModel(TUBE), HeatModel(TUBE)
    for model in (at_once, by_and_by):
        model.report(25.0)
    at_once.advance(200, 4321)
    for _ in range(4321):
        by_and_by.advance(200)
    assert states(at_once) == states(by_and_by)


def test_an_uncalibrated_tube_counts_by_the_strongest_and_shows_as_the_weakest():
    unknown = HeatModel()
    unknown.advance(255, 5000)
    for tube, found in ((MOST, unknown.most), (LEAST, unknown.least)):
        model = HeatModel(tube)
        model.advance(255, 5000)
        assert model.most == found


def test_a_sensor_can_only_make_a_tube_count_as_warmer():
    model = HeatModel(TUBE)
    model.advance(255, 5000)
    most = model.most
    model.report(0.0)
    assert model.most == most
    model.report(100.0)
    assert model.highest_rise == pytest.approx(75.0)


def give_until_fault(board, rate):
    """Full duty, shown by a rate [0.1 C/s]."""
    for ms in range(0, 60_000, 10):
        if board.faults:
            return
        board.ask("DUTY", 255, 0, 250 + ms * rate // 1000, 250)
        board.tick(10)


def frozen(_):
    return 250


def flickering(ms):
    return 250 + ms // 400 % 2


def falling(ms):
    return 250 - ms // 100


def a_quarter(ms):
    return 250 + round(10 * 4.5 * ms / 1000 / 4)


@pytest.mark.parametrize("shown", [frozen, flickering, falling, a_quarter])
def test_heat_that_does_not_show_is_noticed(board, shown):
    give(board, 255, shown, 3200)
    assert board.faults == 0
    give(board, 255, lambda ms: shown(ms + 3200), 700)
    assert board.faults == Fault.SENSOR
    assert board.duties == (0, 0)


@pytest.mark.parametrize("every", [90, 300, 6000])
def test_a_pause_does_not_clear_what_has_not_shown(board, every):
    """30 ms without heat now and then, as the host itself makes them."""
    heated = 0
    while board.faults == 0 and heated < 20_000:
        give(board, 255, 250, every - 30)
        give(board, 0, 250, 30)
        heated += every
    assert board.faults & Fault.SENSOR
    assert heated < 6000 + every


def test_less_heat_has_longer_to_show(board):
    give(board, 100, 250, 9000)
    assert board.faults == 0
    give(board, 100, 250, 3000)
    assert board.faults == Fault.SENSOR


@pytest.mark.parametrize("share", [0.6, 1.0, 1.5])
def test_a_sensor_that_shows_heat_is_good(board, share):
    """Late by a second, and in steps of 0.4 s as the meter has them."""
    tube = HeaterTube(4.5, 48.0, 25.0)
    past = [25.0] * 34
    for number in range(700):
        duty = 255 if number < 400 else 0
        past.append(tube.temperature)
        shown = past[-34 - number % 13]
        board.ask("DUTY", duty, 0, round(10 * (25.0 + share * (shown - 25.0))), 250)
        board.tick(30)
        tube.advance(duty, 0.03)
        assert board.faults == 0


def test_a_tube_that_cools_and_is_heated_again_is_good(board):
    tube = HeaterTube(4.5, 48.0, 25.0)
    for number in range(6000):
        duty = 255 if tube.temperature < 60.0 and number // 1000 % 2 == 0 else 0
        board.ask("DUTY", duty, 0, round(10 * tube.temperature), 250)
        board.tick(30)
        tube.advance(board.duties[0], 0.03)
        assert board.faults == 0


@pytest.mark.parametrize("duty", [255, 127, 108])
def test_energy_is_bounded_at_every_duty_whatever_is_shown(board, duty):
    """The sensor shows 40 % of the rise: alive, and wrong."""
    tube = HeaterTube(4.5, 48.0, 25.0)
    for _ in range(8000):
        shown = 25.0 + 0.4 * (tube.temperature - 25.0)
        board.ask("DUTY", duty, 0, round(10 * shown), 250)
        board.tick(30)
        tube.advance(board.duties[0], 0.03)
        assert tube.temperature < 115.5
    assert board.faults == Fault.HEAT
    assert board.ask("CLEAR") == [Reply(1, ("0",))]  # it has cooled meanwhile


def test_the_bound_clears_only_after_cooling(board):
    give_until_fault(board, 18)
    assert board.faults == Fault.HEAT
    assert board.ask("CLEAR") == [Error(1, "FAULT")]
    board.tick(2600)
    assert board.ask("CLEAR") == [Error(1, "FAULT")]
    board.tick(400)
    assert board.ask("CLEAR") == [Reply(1, ("0",))]


def test_the_bound_can_be_tightened(board):
    board.ask("LIMIT", 255, 200, 1100)
    give_until_fault(board, 30)
    assert board.faults == Fault.HEAT
    assert board.thermal(0)[0] == pytest.approx(200 * 104858, rel=0.02)


@pytest.mark.parametrize(
    ("known", "hot", "rise", "faults"),
    [
        (True, False, 880, Fault.HEAT),
        (True, True, 100, 0),
        (False, True, 0, Fault.HEAT),
        (False, False, 880, 0),
    ],
)
def test_what_is_remembered_of_the_tubes_counts(board, known, hot, rise, faults):
    board.restart(known=known, hot=hot, rise=rise)
    assert board.faults == 0  # warm tubes that cool are none
    give(board, 255, lambda ms: 250 + ms * 40 // 1000, 900)
    assert board.faults == faults


@pytest.mark.parametrize(
    ("channel", "gain", "cooling", "code"),
    [
        (0, 99, 480, "RANGE"),
        (0, 1001, 480, "RANGE"),
        (1, 450, 99, "RANGE"),
        (1, 450, 1001, "RANGE"),
    ],
)
def test_no_tube_is_calibrated_to_what_cannot_be(board, channel, gain, cooling, code):
    told = Decoder().feed(board.feed(frame(f">1 TUBE {channel} {gain} {cooling}")))
    assert told == [Error(1, code)]
    assert not board.stores
    assert board.ask("TUBES") == [Reply(1, ("450", "480", "0", "0"))]


def test_calibration_is_stored_and_told(board):
    assert board.ask("TUBE", 1, 300, 600) == [Reply(1, ("300", "600"))]
    assert board.stores
    assert board.ask("TUBES") == [Reply(1, ("450", "480", "300", "600"))]


def test_it_is_refused_while_a_heater_is_on_and_by_a_sensor_board(board, firmware):
    board.ask("DUTY", 0, 5, 250, 250)
    assert board.ask("TUBE", 0, 300, 600) == [Error(1, "HEAT")]
    assert HostFirmware(firmware, heater=False).ask("TUBE", 0, 300, 600) == [Error(1, "ROLE")]
    assert not board.stores


def test_tubes_between_the_ends_never_exceed_the_bound():
    """Whatever tube is calibrated within 5 %: 90 C of modelled rise are less than 95 C of true."""
    random = np.random.default_rng(2)
    for _ in range(20):
        tube = TubeModel(int(random.integers(100, 1001)), int(random.integers(100, 1001)))
        off = random.uniform(0.95, 1.05)
        true = HeaterTube(tube.rate * off, tube.cooling_time, 0.0)
        model, duty = HeatModel(tube), int(random.integers(60, 256))
        for _ in range(20_000 // STEP_MS):
            duty = duty if not model.above(MOST_RISE) else 0
            model.advance(duty, STEP_MS)
            true.advance(duty, STEP_MS / 1000)
            assert true.temperature < 95.0 + 0.3


def test_constants_are_the_firmware_s(firmware):
    text = (firmware.parent / "src" / "limits.h").read_text()
    text += (firmware.parent / "src" / "thermal.h").read_text()
    for name, value in (
        ("LIMIT_RISE", 10 * MOST_RISE),
        ("MUST_SHOW", 10 * MUST_SHOW),
        ("ROOM", 10 * ROOM),
        ("TUBE_GAIN_LEAST", LEAST.gain),
        ("TUBE_GAIN_MOST", MOST.gain),
        ("TUBE_COOLING_LEAST", LEAST.cooling),
        ("TUBE_COOLING_MOST", MOST.cooling),
        ("THERMAL_STEP_MS", STEP_MS),
    ):
        assert f"#define {name} {value:g} " in text.replace("\n", " ")
