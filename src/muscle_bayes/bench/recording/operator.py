"""Who hangs the loads, and tells so by a key."""

import os
import select
import sys
from contextlib import suppress
from typing import Any, Protocol

from muscle_bayes.errors import MuscleBayesError

try:
    import termios
    import tty
except ImportError:  # Windows has neither
    termios = tty = None  # type: ignore[assignment]

STOP_KEYS = (b"q", b"Q", b"\x1b", b"\x03")


class Operator(Protocol):
    """Asked for loads; `poll` tells what was pressed since."""

    def ask(self, load: float, pour_time: float) -> None:
        """Ask for a load [kg], to hang or, over a time [s], to be poured from the key on."""

    def poll(self) -> str | None:
        """ "go" at any key, "stop" at q, None if nothing was pressed. Never waits."""


class Keyboard:
    """Keys of the terminal, without the need of Enter; on a pipe, its bytes."""

    def __init__(self, descriptor: int | None = None) -> None:
        """On standard input unless a descriptor is given."""
        self._before: Any = None
        self._asked = False
        self._descriptor = _standard_input() if descriptor is None else descriptor
        self._ended = self._descriptor < 0
        if termios is not None and not self._ended and os.isatty(self._descriptor):
            self._before = termios.tcgetattr(self._descriptor)
            tty.setcbreak(self._descriptor)

    def ask(self, load: float, pour_time: float) -> None:
        """Raises MuscleBayesError where there is no keyboard."""
        self._asked = True
        self._refuse_silence()
        if self._before is not None:
            termios.tcflush(self._descriptor, termios.TCIFLUSH)  # keys from before the question

    def poll(self) -> str | None:
        if self._ended or not select.select([self._descriptor], [], [], 0)[0]:
            return None
        keys = os.read(self._descriptor, 1)
        if not keys:
            self._ended = True
            if self._asked:
                self._refuse_silence()
            return None
        if keys in STOP_KEYS:
            return "stop"
        self._asked = False
        return "go"

    def close(self) -> None:
        """Give the keyboard back; never raises."""
        if self._before is not None:
            with suppress(termios.error, OSError):
                termios.tcsetattr(self._descriptor, termios.TCSADRAIN, self._before)

    def _refuse_silence(self) -> None:
        if self._ended:
            raise MuscleBayesError(
                "a load has to be changed and nobody can press a key: there is no keyboard. "
                "Fix: run this in a terminal, or use a sequence without loads in its stages."
            )


def _standard_input() -> int:
    """Its descriptor, -1 where there is none."""
    try:
        return sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):
        return -1
