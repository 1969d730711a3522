"""The bench's lines, together."""

from dataclasses import dataclass

from muscle_bayes.bench.boards.board import Board
from muscle_bayes.bench.boards.clock import Clock
from muscle_bayes.bench.boards.link import Link
from muscle_bayes.bench.meters.meter import MeterSource


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
