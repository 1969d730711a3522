"""The host's clock, real or virtual, and how a board's own clock is told on it."""

import time
from collections import deque
from dataclasses import dataclass
from math import inf
from statistics import linear_regression
from typing import Final, Protocol

WRAP: Final = 2**32
"""A board's microseconds wrap here, after 71.6 min."""
MOST_SLEW: Final = 0.01
"""Most that board time is stretched while the estimate moves; an Uno's resonator may be 0.5 % off."""
MOST_STEP: Final = 0.5
"""Disagreement of the two clocks, s, that is no drift: the board or the host was set back."""
_BLOCK: Final = 5.0
"""Span within which the quickest arrival is sought, s."""
_BLOCKS: Final = 60
_RATE_BLOCKS: Final = 6


class Clock(Protocol):
    """What everything that waits or reads time is given."""

    def now(self) -> float:
        """Seconds from any origin, never going back."""

    def sleep(self, seconds: float) -> None:
        """Let that much time pass."""


class RealClock:
    """The host's own monotonic clock."""

    def now(self) -> float:
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        time.sleep(max(seconds, 0.0))


@dataclass(frozen=True)
class Stamp:
    """When a sample was taken, on the host's clock."""

    time: float
    """s"""
    latency: float
    """s between taking and arrival, beyond the quickest arrivals'"""
    step: float = 0.0
    """s by which the board's clock had to be set anew; 0 as long as it only drifts"""


class BoardClock:
    """Board time d [s] -> host time t = d + o, with an offset o that follows the drift of both.

    Arrivals h are late, never early: h - d >= o, with equality for the quickest. The quickest
    arrival of each 5 s gives one point, the slope of the points of the last 5 min the board's rate,
    and the lowest of the newest points the offset. Times rise by no more than 1 % away from the
    board's own spacing, so no arrival's delay enters the spacing of rows. An arrival that is early
    by more than 0.5 s tells that a clock was set anew: the map starts again there.
    """

    def __init__(self) -> None:
        self._micros: int | None = None
        self._board = 0.0
        self._arrival = 0.0
        self._time = -inf
        self._points: deque[tuple[float, float]] = deque(maxlen=_BLOCKS)
        self._block_end = 0.0

    @property
    def rate(self) -> float:
        """Host seconds per board second, less 1; 0 until 30 s have passed."""
        points = list(self._points)[:-1]  # the last block is not over
        if len(points) < _RATE_BLOCKS:
            return 0.0
        return linear_regression(*zip(*points, strict=True)).slope

    def restart(self) -> None:
        """Forget the board's clock: it was reset, or the line was down."""
        self._micros = None

    def stamp(self, micros: int, arrival: float) -> Stamp:
        """Host time of a sample taken at the board's `micros` that came at host time `arrival`."""
        if self._micros is None:
            return self._start(micros, arrival)
        passed = ((micros - self._micros) % WRAP) / 1e6
        turns = max(0, round((arrival - self._arrival - passed) / (WRAP / 1e6)))
        passed += turns * WRAP / 1e6
        early = self._offset(self._board + passed) - (arrival - self._board - passed)
        if early > MOST_STEP + 0.01 * passed:
            expected = self._time + passed
            stamp = self._start(micros, arrival)
            return Stamp(stamp.time, 0.0, stamp.time - expected)
        self._micros, self._arrival = micros, arrival
        self._board += passed
        self._collect(arrival)
        straight, slew = self._time + passed, MOST_SLEW * passed
        wanted = self._board + self._offset(self._board)
        self._time = min(max(wanted, straight - slew), straight + slew)
        return Stamp(self._time, max(arrival - self._time, 0.0))

    def _start(self, micros: int, arrival: float) -> Stamp:
        self._micros, self._arrival, self._board = micros, arrival, 0.0
        self._time = max(arrival, self._time + 1e-3)
        self._points.clear()
        self._points.append((0.0, arrival))
        self._block_end = _BLOCK
        return Stamp(self._time, 0.0)

    def _collect(self, arrival: float) -> None:
        point = (self._board, arrival - self._board)
        if self._board >= self._block_end:
            self._points.append(point)
            self._block_end = self._board + _BLOCK
        elif point[1] < self._points[-1][1]:
            self._points[-1] = point

    def _offset(self, board: float) -> float:
        rate = self.rate
        newest = list(self._points)[-_RATE_BLOCKS:]
        return min(offset + rate * (board - at) for at, offset in newest)
