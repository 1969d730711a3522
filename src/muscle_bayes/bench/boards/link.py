"""A device that may go and come back, and the bench's devices together."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from muscle_bayes.bench.boards.board import Board
from muscle_bayes.bench.boards.clock import Clock
from muscle_bayes.bench.meters.meter import MeterSource
from muscle_bayes.errors import MuscleBayesError

RETRY: Final = 1.0
"""s between attempts to open a line again."""


class Link[D: Board | MeterSource]:
    """A device, and how to open it again. `device` is None while it is away."""

    def __init__(self, name: str, opener: Callable[[], D], clock: Clock) -> None:
        self.name = name
        self.device: D | None = None
        self.problem = ""
        """why it is away"""
        self._opener = opener
        self._clock = clock
        self._next_try = 0.0

    def open(self) -> D:
        """Open it. Raises MuscleBayesError."""
        self.device = self._opener()
        return self.device

    def lose(self, error: MuscleBayesError) -> None:
        """It is gone: let go of it, to be opened again after a while."""
        self.problem = str(error)
        if self.device is not None:
            self.device.close()
        self.device = None
        self._next_try = self._clock.now() + RETRY

    def retry(self) -> D | None:
        """Try to open it again where that is due; None if it stays away."""
        if self._clock.now() < self._next_try:
            return None
        try:
            return self.open()
        except MuscleBayesError as error:
            self.lose(error)
            return None

    def close(self) -> None:
        """Never raises."""
        if self.device is not None:
            with suppress(MuscleBayesError):
                self.device.close()
        self.device = None


@dataclass
class Devices:
    """Both boards and the meter, and the clock that they are read by."""

    sensor: Link[Board]
    heater: Link[Board]
    meter: Link[MeterSource]
    clock: Clock

    def open(self) -> None:
        """Open all. Raises MuscleBayesError; nothing stays open then."""
        try:
            for link in (self.heater, self.sensor, self.meter):
                link.open()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Never raises."""
        for link in (self.heater, self.sensor, self.meter):
            link.close()
