"""The old sketch's protocol: old scripts run, under the new safety."""

from math import log

import pytest
from host_firmware import (
    OLD_ANALOG_READ,
    OLD_DIGITAL_READ,
    OLD_NOTHING,
    HostFirmware,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from muscle_bayes.bench.boards.messages import Fault, ResetCause
from muscle_bayes.bench.boards.protocol import encode
from muscle_bayes.bench.simulation.processor import FREQUENCY, Processor

PROMPT = b"w\r\n"
STOPPED = b"heaters off, fault 1; open the port again\r\n"


@pytest.fixture
def board(firmware):
    return HostFirmware(firmware)


def test_the_board_asks_first(board):
    assert board.greeting.endswith(PROMPT)


def test_every_number_is_followed_by_the_next_question(board):
    assert board.old(3) == PROMPT
    assert board.old(6) == PROMPT
    assert board.old(77) == PROMPT
    assert board.duties == (77, 0)


@pytest.mark.parametrize("ending", [b"", b"\n", b"\r\n", b" "])
def test_numbers_may_end_with_a_blank_or_with_silence(board, ending):
    for number in (b"3", b"5", b"200"):
        board.tick(2)
        board.feed(number + ending)
        board.tick(4)
    assert board.duties == (0, 200)


@pytest.mark.parametrize(
    ("numbers", "duties"),
    [
        ((3, 6, 255), (255, 0)),
        ((3, 5, 1), (0, 1)),
        ((1, 6), (255, 0)),
        ((1, 6, 0, 6), (0, 0)),
        ((1, 6, 1, 5, 0, 6), (0, 255)),
        ((3, 6, 256), (0, 0)),
        ((3, 9, 255), (0, 0)),
        ((3, 13, 255), (0, 0)),
        ((3, 99, 3, 6, 40), (40, 0)),
        ((99, 3, 6, 40), (40, 0)),
        ((3, 6, 99), (99, 0)),
        ((7, 3, 6, 40), (40, 0)),
        ((12345, 3, 6, 40), (40, 0)),
    ],
)
def test_pins_are_set(board, numbers, duties):
    board.old(*numbers)
    assert board.duties == duties


@pytest.mark.parametrize(("command", "action"), [(2, OLD_DIGITAL_READ), (4, OLD_ANALOG_READ)])
def test_pins_are_read(board, command, action):
    board.old(command)
    assert board.old(3) == b""
    assert board.wanted_pin == (action, 3)
    assert board.pin_value(517) == b"517\r\n" + PROMPT
    assert board.wanted_pin[0] == OLD_NOTHING


def test_the_dead_man_watches_old_scripts_too(board):
    board.old(1, 6)
    board.tick(390)
    assert board.duties == (255, 0)
    assert board.tick(10) == STOPPED
    assert board.duties == (0, 0)
    assert board.faults == Fault.DEADMAN
    board.old(1, 6)
    assert board.duties == (0, 0)


def test_an_old_script_is_asked_no_more_but_told_every_second_of_a_fault(board):
    """It waits for `w`, or reads a number: it stops or stumbles, and its screen shows why."""
    board.old(1, 6)
    board.tick(400)
    for _ in range(3):
        assert board.tick(1000).count(b"heaters off") == 1
    told = board.old(4)
    assert b"w" not in told
    assert b"w" not in STOPPED
    with pytest.raises(ValueError, match="heaters off, fault 1"):
        int(STOPPED)


def test_reading_pins_does_not_feed_the_dead_man(board):
    board.old(1, 6)
    for _ in range(20):
        board.old(4, 0)
        board.pin_value(1)
        board.tick(20)
    assert board.duties == (0, 0)


def test_the_heat_model_bounds_old_scripts(board):
    """No temperature reaches the board: half power ends before a tube can be above 115 C."""
    for channel in range(2):
        board.calibrate(channel, 450, 480)
    heated = 0.0
    while board.faults == 0 and heated < 200.0:
        board.old(3, 6, 127)
        board.tick(82)
        heated += 0.1
    assert board.faults == Fault.HEAT
    assert heated == pytest.approx(48.0 * log(108 / 18), abs=1.5)


def test_a_valid_frame_shuts_the_old_protocol_out(board):
    board.feed(encode(1, "ID"))
    assert board.old(3, 6, 200) == b""
    assert board.duties == (0, 0)


@pytest.mark.parametrize("noise", [b"x", b"\xff", b"-"])
def test_noise_voids_a_command_and_is_waited_out(board, noise):
    board.old(3, 6)
    board.tick(2)
    board.feed(b"2" + noise)
    board.feed(b"200\n")
    board.old(3, 6, 200)
    assert board.duties == (0, 0)
    assert board.tick(100) == PROMPT
    board.old(3, 6, 200)
    assert board.duties == (200, 0)


@settings(max_examples=200)
@given(st.lists(st.sampled_from(b"3651 \n0279"), max_size=400))
def test_digits_that_do_not_wait_to_be_asked_heat_nothing(firmware, digits):
    board = HostFirmware(firmware)
    for number, digit in enumerate(digits):
        board.feed(bytes([digit]))
        if number % 11 == 10:  # a full line
            board.tick()
        assert board.duties == (0, 0)


class OldScript:
    """What an old script does: wait for `w`, send a number without end mark, read an answer."""

    def __init__(self, processor):
        self.processor = processor
        self.lines = b""

    def line(self):
        for _ in range(1200):
            if b"\n" in self.lines:
                line, self.lines = self.lines.split(b"\n", 1)
                return line.strip()
            self.processor.run(1)
            self.lines += self.processor.receive()
        raise AssertionError("no line came in 1.2 s")

    def send(self, *numbers):
        for number in numbers:
            while self.line() != b"w":
                pass
            self.processor.run(2)  # USB's way there and back
            self.processor.send(str(number).encode())


def test_an_old_script_runs_on_the_compiled_firmware(firmware):
    with Processor(heater=True) as processor:
        script = OldScript(processor)
        script.send(99)
        processor.set_analog(777, 0)
        processor.set_analog(123, 3)
        for channel, counts in ((0, 777), (3, 123), (0, 777), (14, 777), (17, 123)):
            script.send(4, channel)
            assert int(script.line()) == counts
        script.send(2, 4)
        assert int(script.line()) == 0  # the strap of a heater board
        start = processor.run(1)
        assert start == (0.0, 0.0)
        for duty in (10, 200, 255):
            script.send(3, 6, duty, 3, 5, 255 - duty)
            processor.run(8)
            assert processor.duties == (duty, 255 - duty)
        processor.run(400)
        assert processor.duties == (0, 0)
        lines = {script.line() for _ in range(3)}
        assert STOPPED.strip() in lines - {b"w"}
        processor.send(b"1")
        processor.run(1200)
        assert processor.duties == (0, 0)  # the fault is latched
        processor.reset(ResetCause.EXTERNAL)  # opening the port resets the board
        processor.receive()
        script.lines = b""
        script.send(99, 1, 6)
        processor.run(10)
        assert processor.duties == (255, 0)


def test_an_old_script_can_set_both_heaters_often_enough(firmware):
    with Processor(heater=True) as processor:
        script = OldScript(processor)
        script.send(99)
        start = processor.cycle
        for _ in range(10):
            script.send(3, 6, 200, 3, 5, 200)
        assert (processor.cycle - start) / 10 / FREQUENCY < 0.1  # s, of the dead-man's 0.4
