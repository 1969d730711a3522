"""The sensor board's stream of samples on the host's clock, with what was lost on the way."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Any, Final

import numpy as np

from muscle_bayes.bench.boards.board import Board
from muscle_bayes.bench.boards.clock import BoardClock, Clock
from muscle_bayes.bench.boards.messages import AVERAGED
from muscle_bayes.bench.boards.protocol import Boot, ChecksumReport, Garbled, Sample
from muscle_bayes.bench.boards.transport import BOARD_BAUD
from muscle_bayes.errors import MuscleBayesError

_BINS_PER_MS = 10
_MOST_MS = 1000


class Histogram:
    """Times [s] counted in steps of 0.1 ms up to 1 s; quantiles are exact to the step."""

    def __init__(self) -> None:
        self._smallest, self._largest = inf, -inf
        self._bins = np.zeros(_BINS_PER_MS * _MOST_MS + 1, dtype=int)

    def add(self, seconds: float) -> None:
        """Count one."""
        self._smallest, self._largest = min(self._smallest, seconds), max(self._largest, seconds)
        self._bins[min(max(round(seconds * 1e3 * _BINS_PER_MS), 0), self._bins.size - 1)] += 1

    def summary(self) -> dict[str, float]:
        """Smallest, median, 95 and 99.9 % quantiles and largest, ms; empty where none was counted."""
        below = np.cumsum(self._bins)
        if below[-1] == 0:
            return {}
        shares = np.array([0.5, 0.95, 0.999])
        quantiles = np.searchsorted(below, shares * below[-1]) / _BINS_PER_MS
        names = ("min", "median", "p95", "p999", "max")
        told = (1e3 * self._smallest, *quantiles.tolist(), 1e3 * self._largest)
        return dict(zip(names, told, strict=True))


SILENT_AFTER: Final = 1.0
"""Age of the newest sample at which the stream counts as stalled, s, or five periods."""
_LINE_TIME: Final = 32 * 10 / BOARD_BAUD
"""s that a sample's usual 32 bytes are on the line; what USB adds is not known."""
_NUMBERS: Final = 0x10000

Tell = Callable[..., None]
"""tell(kind, **facts): writes down what happened."""


@dataclass(frozen=True)
class TimedSample:
    """A reading [counts] and when it was taken, host clock, s."""

    time: float
    reading: float
    second: float | None = None
    """of a second potentiometer, counts"""
    load: int | None = None
    """newest of a load cell, counts"""


@dataclass
class StreamCounts:
    """What the stream went through."""

    samples: int = 0
    lost: int = 0
    garbled: int = 0
    resets: int = 0
    restarts: int = 0
    """times that the stream had to be asked for again"""


class SampleStream:
    """Samples of a board. Nothing is filled in: what is missing is counted and told."""

    def __init__(self, clock: Clock, period: float, tell: Tell) -> None:
        self.counts = StreamCounts()
        self.spacing = Histogram()
        """of neighbouring samples on the board's own clock"""
        self.latency = Histogram()
        """from sample to host, beyond the quickest arrivals'"""
        self.board_clock = BoardClock()
        self.encoder = False
        """whether the angle is an encoder's count, which a reset of the board loses"""
        self.newest: TimedSample | None = None
        self._clock = clock
        self._period = period
        self._tell = tell
        self._last: Sample | None = None
        self._heard = clock.now()
        self._boot: int | None = None

    def start(self, board: Board) -> None:
        """Ask a board for the stream, a clock anew. Raises BoardError, MuscleBayesError."""
        before, self._boot = self._boot, None if board.identity is None else board.identity.boot
        if self.encoder and before is not None and before != self._boot:
            raise MuscleBayesError(
                "the sensor board was reset, and its encoder has lost its zero. Fix: look for the "
                "cause, then `muscle-bayes calibrate` and record anew"
            )
        board.stream(round(1000 * self._period))
        self.board_clock.restart()
        self._last = None
        self._heard = self._clock.now()

    def stalled(self, now: float) -> bool:
        """Whether samples have stopped coming."""
        return now - self._heard > max(SILENT_AFTER, 5 * self._period)

    def restart(self, board: Board) -> None:
        """Ask again where the stream has stalled. Raises BoardError."""
        self.counts.restarts += 1
        self._tell("stream asked for again", silence=round(self._clock.now() - self._heard, 3))
        self.start(board)

    def poll(self, board: Board) -> list[TimedSample]:
        """Samples that have come. Raises BoardError where the board is lost."""
        now = self._clock.now()
        samples: list[TimedSample] = []
        for message in board.poll():
            if isinstance(message, Sample):
                samples.append(self._take(message, now))
            elif isinstance(message, Boot):
                self._reset(board, message)
            elif isinstance(message, Garbled | ChecksumReport):
                self.counts.garbled += 1
        if samples:
            self.newest, self._heard = samples[-1], now
        return samples

    def figures(self) -> dict[str, Any]:
        """Counts and figures so far."""
        return {
            **vars(self.counts),
            "spacing_ms": self.spacing.summary(),
            "latency_ms": self.latency.summary(),
            "board_clock_ppm": round(-1e6 * self.board_clock.rate, 1),
        }

    def _take(self, sample: Sample, now: float) -> TimedSample:
        self.counts.samples += 1
        last, self._last = self._last, sample
        if last is not None:
            lost = (sample.number - last.number - 1) % _NUMBERS
            if lost:
                self.counts.lost += lost
                self._tell("samples lost", count=lost)
            else:
                self.spacing.add(((sample.micros - last.micros) % 2**32) / 1e6)
        stamp = self.board_clock.stamp(sample.micros, now - _LINE_TIME)
        if stamp.step:
            self._tell("board clock set anew", step=round(stamp.step, 3))
        else:
            self.latency.add(stamp.latency)
        second = None if sample.second is None else sample.second / AVERAGED
        reading = sample.angle / AVERAGED
        if self.encoder:  # its counts are whole, and no noise dithers them
            reading = float(round(reading))
        return TimedSample(stamp.time, reading, second, sample.load)

    def _reset(self, board: Board, boot: Boot) -> None:
        if boot.identity.boot == self._boot:
            return  # told late of the boot that it was found in
        self.counts.resets += 1
        cause = boot.identity.cause
        self._tell("sensor board reset", boot=boot.identity.boot, cause=cause.name or "unknown")
        self.start(board)
