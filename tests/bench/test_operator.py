"""Keys of a terminal and bytes of a pipe."""

import os
import pty
import time

import pytest

from muscle_bayes.bench.recording.operator import Keyboard
from muscle_bayes.errors import MuscleBayesError


@pytest.fixture
def terminal():
    far, near = pty.openpty()
    yield far, near
    os.close(far)
    os.close(near)


def pressed(keyboard):
    end = time.monotonic() + 2.0
    while (key := keyboard.poll()) is None and time.monotonic() < end:
        time.sleep(0.005)
    return key


@pytest.mark.parametrize(
    ("keys", "told"), [(b" ", "go"), (b"x", "go"), (b"q", "stop"), (b"\x1b", "stop")]
)
def test_keys_need_no_enter(terminal, keys, told):
    far, near = terminal
    keyboard = Keyboard(near)
    keyboard.ask(0.1, 0.0)
    assert keyboard.poll() is None
    os.write(far, keys)
    assert pressed(keyboard) == told
    keyboard.close()


def test_keys_from_before_the_question_do_not_count(terminal):
    far, near = terminal
    keyboard = Keyboard(near)
    os.write(far, b"   ")
    time.sleep(0.05)
    keyboard.ask(0.1, 0.0)
    assert keyboard.poll() is None
    keyboard.close()


def test_the_terminal_is_given_back(terminal):
    import termios

    _, near = terminal
    before = termios.tcgetattr(near)
    keyboard = Keyboard(near)
    assert termios.tcgetattr(near) != before
    keyboard.close()
    assert termios.tcgetattr(near) == before


def test_pipe_that_ends_is_told_when_a_key_is_needed():
    reading, writing = os.pipe()
    os.write(writing, b"x")
    keyboard = Keyboard(reading)
    keyboard.ask(0.1, 0.0)
    assert keyboard.poll() == "go"
    os.close(writing)
    assert keyboard.poll() is None  # nobody was asked
    with pytest.raises(MuscleBayesError, match="no keyboard"):
        keyboard.ask(0.2, 0.0)
    keyboard.close()
    os.close(reading)


def test_pipe_that_ends_while_a_key_is_awaited():
    reading, writing = os.pipe()
    keyboard = Keyboard(reading)
    keyboard.ask(0.1, 0.0)
    os.close(writing)
    with pytest.raises(MuscleBayesError, match="no keyboard"):
        keyboard.poll()
    os.close(reading)
