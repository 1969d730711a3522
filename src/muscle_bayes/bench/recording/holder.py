"""The loop that has the heater board hold an angle: setpoint and temperatures down, samples to rows."""

from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

from muscle_bayes.bench.boards.board import Board, BoardError, tenths
from muscle_bayes.bench.boards.clock import Clock
from muscle_bayes.bench.boards.messages import explain
from muscle_bayes.bench.boards.samples import SampleStream, TimedSample
from muscle_bayes.bench.heat.heating import Heating
from muscle_bayes.bench.heat.thermometry import far_from_room
from muscle_bayes.bench.meters.meter import MeterSource, first_reading
from muscle_bayes.bench.recording.guard import RecordingError
from muscle_bayes.bench.recording.log_row import AIM
from muscle_bayes.bench.recording.loop import FIRST_READING, RecordingLoop
from muscle_bayes.bench.recording.rows import RowWriter
from muscle_bayes.bench.recording.run_file import RunFile
from muscle_bayes.errors import MuscleBayesError

PERIOD: Final = 0.03
"""s between rows."""
TOLD_EVERY: Final = 0.1
"""s between two HOLD commands; the board's dead-man waits 0.4 s."""
MOST: Final = 1023

Aim = Callable[[float], float]
"""Angle that is wanted [rad] at a time [s] after the first row."""


class Holder(RecordingLoop):
    """Holds or tracks on an open heater board with a meter.

    The potentiometer is on the heater board, which streams it: no sensor board is needed.
    """

    def __init__(
        self,
        board: Board,
        meter: MeterSource,
        clock: Clock,
        file: RunFile,
        aim: Aim,
        duration: float,
        *,
        progress: Callable[[float], None] = lambda time: None,
    ) -> None:
        """`duration` in s; `progress` follows the time [s].

        Raises MuscleBayesError where the metadata state no potentiometer.
        """
        super().__init__(clock, file)
        self._board, self._meter = board, meter
        self._aim, self._duration, self._progress = aim, duration, progress
        sensor = file.metadata.potentiometer
        if sensor is None or sensor.zero_reading is None or sensor.radians_per_count is None:
            raise MuscleBayesError(
                "the rig has no [potentiometer] with zero_reading and radians_per_count. Fix: "
                "`muscle-bayes calibrate`, and its table in the --rig"
            )
        self._zero, self._scale = float(sensor.zero_reading), float(sensor.radians_per_count)
        self._room = file.metadata.fixture.room_temperature
        self._heating = Heating((True, True), room=self._room)
        self._stream = SampleStream(clock, PERIOD, self._tell)
        file.more = (AIM,)
        self._rows = RowWriter(
            file, self._heating, PERIOD, self._tell, lambda: (board.heat, None), aim=self._wanted
        )
        self._next = 0.0

    def counts(self, angle: float) -> int:
        """Reading of the potentiometer at an angle [rad]. Raises MuscleBayesError beyond its range."""
        reading = round(self._zero + angle / self._scale)
        if not 0 <= reading <= MOST:
            raise MuscleBayesError(
                f"the angle {angle:.3f} rad is beyond the potentiometer: it would read {reading}. Fix: "
                f"ask for {(0 - self._zero) * self._scale:.2f} to "
                f"{(MOST - self._zero) * self._scale:.2f} rad at most"
            )
        return reading

    def _start(self) -> None:
        board, clock = self._board, self._clock
        reading = first_reading(self._meter, clock, FIRST_READING)
        if question := far_from_room(reading, self._room):
            raise MuscleBayesError(
                f"{question}. Fix: wait until the tubes are cold, or correct the room"
            )
        self._heating.take(reading)
        self._heating.begin(clock.now())
        tubes = board.tubes()
        if None in tubes:
            raise RecordingError(
                "the heaters are not calibrated. Fix: run `muscle-bayes calibrate-heaters` once"
            )
        self._heating.calibrate(tubes)
        if board.faults:
            raise RecordingError(
                f"the heater board keeps its heaters off: {explain(board.faults)}. Fix: look for the "
                "cause, then press its reset button"
            )
        self._tell("start", stages=1)
        self._tell("stage", number=1, what="hold", note="", to_go=self._duration)
        try:
            reported = map(tenths, self._heating.temperatures)
            board.request("HOLD", self.counts(self._aim(0.0)), *reported)
        except BoardError as error:
            raise RecordingError(
                f"{error} Fix: write gains with `muscle-bayes tune ... --header gains.h`, build them in "
                "with `make firmware GAINS=gains.h` and load them with `muscle-bayes flash`; "
                "the potentiometer goes to A0 of the heater board as well"
            ) from None
        self._stream.start(board)
        self._next = clock.now()

    def _heaters_off(self) -> bool:
        off = self._request("OFF")
        self._request("STREAM", 0)
        return off

    def _request(self, verb: str, *arguments: int) -> bool:
        """Whether the board has answered."""
        with suppress(MuscleBayesError):
            self._board.request(verb, *arguments, timeout=0.5)
            return True
        return False

    def _turn(self) -> str:
        for sample in self._stream.poll(self._board):
            self._rows.write(sample, ())
        self._meter.poll()
        now = self._clock.now()
        if self._rows.time >= self._duration:
            return "the time is over"
        if now < self._next:
            return ""
        self._next = now + TOLD_EVERY
        if self._board.faults:
            raise RecordingError(
                f"the heater board has switched its heaters off: {explain(self._board.faults)}. "
                "Fix: look for the cause, then press its reset button"
            )
        if self._stream.stalled(now):
            raise RecordingError("the heater board sends no samples. Fix: check cable and power")
        self._judge(now)
        wanted = self.counts(self._aim(self._rows.log_time(now)))
        self._board.command_hold(wanted, *self._heating.temperatures)
        self._progress(self._rows.time)
        return ""

    def _judge(self, now: float) -> None:
        """What the host makes of the meter and of the heat that the board says it gives."""
        heat = self._board.heat
        for channel, duty in zip(
            self._heating.channels, (0, 0) if heat is None else heat.duties, strict=True
        ):
            channel.duty = channel.control.duty = duty
        self._heating.watch(self._meter, now)
        if (trouble := self._heating.trouble or self._heating.alarm) is not None:
            raise RecordingError(trouble)

    def _wanted(self, sample: TimedSample) -> float:
        return self.counts(self._aim(self._rows.log_time(sample.time)))

    def _figures(self) -> dict[str, Any]:
        return self._stream.figures()
