"""A host that heats: meter, temperature control and heater board, as a recording uses them."""

from collections.abc import Callable
from contextlib import suppress
from typing import Final

from muscle_bayes.bench.boards.board import Board, BoardError
from muscle_bayes.bench.boards.link import Link
from muscle_bayes.bench.boards.protocol import Boot
from muscle_bayes.bench.heat.heating import Heating
from muscle_bayes.bench.heat.temperature_control import PERIOD
from muscle_bayes.bench.heat.thermometry import far_from_room
from muscle_bayes.bench.meters.board_meter import BoardMeter
from muscle_bayes.bench.meters.meter import Meter, MeterError, MeterSource, first_reading
from muscle_bayes.bench.sequences.sequence import Stage
from muscle_bayes.bench.simulation.bench import STEP, SimulatedBench
from muscle_bayes.errors import MuscleBayesError

ROOM: Final = 25.0
"""C"""
_POLL: Final = 0.005


class HeatingHost:
    """Heats both channels to setpoints [C]. Time passes in `run` alone; a host not run is dead.

    `on_period` is called with the host's time at the end of every control period.
    """

    def __init__(
        self,
        bench: SimulatedBench,
        setpoints: tuple[float, float],
        on_period: Callable[[float], None] = lambda now: None,
    ) -> None:
        self.bench = bench
        self.board = Board(bench.heater_board, bench.clock, "heater board")
        self.meter: MeterSource = Meter(bench.meter, bench.clock)
        self.heating = Heating((True, True))
        self.stopped: str | None = None
        """Why the host has given up."""
        self._on_period = on_period
        self.board.identify()
        self.board.poll()  # what it said when it booted
        self.heating.calibrate(self.board.tubes())
        if bench.own_thermometers:
            link = Link("heater board", lambda: self.board, bench.clock)
            link.open()
            self.meter = BoardMeter(link, bench.clock)
        reading = first_reading(self.meter, bench.clock, 3.0)
        if question := far_from_room(reading, ROOM):
            raise MuscleBayesError(question)
        self.heating.aim(Stage(setpoint_a=setpoints[0], setpoint_b=setpoints[1], duration=1e6))

    def run(self, seconds: float) -> None:
        """Control for that long; where the board is lost or restarts, heat no more."""
        clock = self.bench.clock
        end = clock.now() + seconds - STEP / 2
        while clock.now() < end:
            due = clock.now() + PERIOD
            if self.stopped is None:
                try:
                    self._control()
                except (BoardError, MeterError) as error:
                    self._stop(str(error))
            while clock.now() < due - STEP / 2:
                clock.sleep(min(_POLL, due - clock.now()))
                with suppress(MeterError):
                    self.meter.poll()
            self._on_period(clock.now())

    def _control(self) -> None:
        now = self.bench.clock.now()
        self.meter.poll()
        if any(isinstance(message, Boot) for message in self.board.poll()):
            self._stop("the board has restarted")
            return
        self.heating.watch(self.meter, now)
        if (alarm := self.heating.alarm) is not None:
            self._stop(alarm)
            return
        duties = self.heating.step(now, hold_off=bool(self.board.faults))
        self.board.command_duty(*duties, *self.heating.temperatures)

    def _stop(self, why: str) -> None:
        self.stopped = why
        with suppress(BoardError):
            self.board.off()
