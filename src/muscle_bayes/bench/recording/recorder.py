"""The loop that records one run: samples to rows, temperatures to duties, stages to setpoints."""

from collections.abc import Callable
from math import isfinite
from typing import Any, Final, Literal

from muscle_bayes.bench.boards.board import HeaterState
from muscle_bayes.bench.boards.link import Devices
from muscle_bayes.bench.boards.messages import explain
from muscle_bayes.bench.boards.samples import SampleStream, TimedSample
from muscle_bayes.bench.heat.heating import Heating
from muscle_bayes.bench.heat.temperature_control import PERIOD
from muscle_bayes.bench.meters.meter import first_reading
from muscle_bayes.bench.recording.guard import Guard, RecordingError
from muscle_bayes.bench.recording.log_row import LOAD, SECOND
from muscle_bayes.bench.recording.loop import FIRST_READING, RecordingLoop, StoppedError
from muscle_bayes.bench.recording.operator import Operator
from muscle_bayes.bench.recording.rows import RowWriter
from muscle_bayes.bench.recording.run_file import RunFile
from muscle_bayes.bench.recording.status import Status, View
from muscle_bayes.bench.recording.weigher import Weigher
from muscle_bayes.bench.sequences.course import Course, StopWatch, describe
from muscle_bayes.bench.sequences.sequence import LoadCell, RunPlan, Sequence
from muscle_bayes.data.sensor import sensor_of

SHOWN_EVERY: Final = 0.25
FIGURES_EVERY: Final = 60.0
MOST_ASTRAY, LEAST_ASTRAY = 0.05, 0.005
"""Share of a load, and kg, by which the load cell may differ from what was asked for, untold."""
UNCALIBRATED_RISE: Final = 12.0
"""Highest setpoint above the room for a heater that is not calibrated, C."""


class Recorder(RecordingLoop):
    """Records one run of a sequence: samples to rows, temperatures to duties, stages to setpoints."""

    def __init__(
        self,
        devices: Devices,
        plan: RunPlan,
        file: RunFile,
        operator: Operator,
        sequence: Sequence,
        view: View,
        load_cell: LoadCell | None = None,
        wall_time: Callable[[], float] | None = None,
    ) -> None:
        """`wall_time` gives Unix time, None where time is virtual."""
        super().__init__(devices.clock, file)
        self._limits, period = sequence.limits, sequence.log_period
        self._devices = devices
        self._plan = plan
        self._operator = operator
        self._view = view
        self._wall_time = wall_time
        room = file.metadata.fixture.room_temperature
        self._heating = Heating(
            (_needs(plan, file, "a"), _needs(plan, file, "b")),
            room=room,
            max_duty=self._limits.max_duty,
        )
        self._stream = SampleStream(self._clock, period, self._tell)
        self._guard = Guard(devices, self._stream, self._heating, self._limits, self._tell, room)
        self._course = Course(plan, stage_timeout=self._limits.stage_timeout)
        self._sensor = sensor_of(file.metadata, [0])
        self._stop = StopWatch(sequence.stop, self._sensor)
        self._weigher = None if load_cell is None else Weigher(load_cell, self._weighed)
        self._rows = RowWriter(
            file, self._heating, period, self._tell, self._heater_state, self._weigh
        )
        self._asked_since = 0.0
        self._next_control = self._next_shown = self._next_figures = 0.0

    @property
    def load(self) -> float:
        """kg that hang."""
        return self._course.load

    def _start(self) -> None:
        meter = self._devices.meter.device
        assert meter is not None, "the devices are open"
        self._heating.take(first_reading(meter, self._clock, FIRST_READING))
        self._heating.begin(self._clock.now())
        if self._heating.trouble is not None:
            raise RecordingError(self._heating.trouble)
        self._read_wiring()
        self._guard.start()
        self._refuse_uncalibrated()
        self._tell(
            "start",
            stages=self._course.total,
            unix_time=None if self._wall_time is None else round(self._wall_time(), 3),
            **{
                link.name: vars(link.device.identity)
                for link in (self._devices.sensor, self._devices.heater)
                if link.device is not None and link.device.identity is not None
            },
        )
        now = self._clock.now()
        self._next_control = now
        self._next_figures = now + FIGURES_EVERY
        self._begin_stage(now)

    def _read_wiring(self) -> None:
        """What the sensor board measures besides the potentiometer."""
        board = self._devices.sensor.device
        assert board is not None, "the devices are open"
        wiring = board.wiring()
        if wiring.load and self._weigher is None:
            raise RecordingError(
                "the sensor board has a load cell that is not calibrated. Fix: `muscle-bayes "
                "calibrate-load`, and its table [load_cell] in the sequence or the --rig"
            )
        self._stream.encoder = bool(wiring.angle)
        self._file.more = (SECOND,) * wiring.second + (LOAD,) * wiring.load
        if wiring.angle:
            if not board.encoder_marked():
                raise RecordingError(
                    "the encoder has lost its zero: it counts from wherever the board got power. "
                    "Fix: `muscle-bayes calibrate`, and its table [potentiometer] in the --rig"
                )
            self._file.read_by_encoder()

    def _weigh(self, sample: TimedSample) -> float | None:
        if self._weigher is None:
            return None
        if self._file.rows == 0:
            self._weigher.begin(sample.time)
        return self._weigher.mass(sample)

    def _weighed(self, mass: float) -> None:
        asked = self._course.load
        self._tell("load weighed", mass=round(mass, 6), asked=asked)
        self._file.correct_load(mass)
        if abs(mass - asked) > max(MOST_ASTRAY * asked, LEAST_ASTRAY):
            self._file.note(
                f"The load cell shows {1000 * mass:.1f} g, asked for {1000 * asked:g} g."
            )

    def _heater_state(self) -> tuple[HeaterState | None, bool | None]:
        board = self._devices.heater.device
        return (None, None) if board is None else (board.heat, board.fan)

    def _refuse_uncalibrated(self) -> None:
        """A board that does not know its tubes lets them get little warmer than the room."""
        room = self._file.metadata.fixture.room_temperature
        for channel in self._heating.channels:
            key = f"setpoint_{channel.side}"
            highest = max(getattr(stage, key) or 0.0 for stage in self._plan.once_through())
            if channel.model.model is None and highest > room + UNCALIBRATED_RISE:
                raise RecordingError(
                    f"heater {channel.side.upper()} is not calibrated, and {highest:g} C is more "
                    f"than {UNCALIBRATED_RISE:g} C above the room. Fix: run `muscle-bayes "
                    "calibrate-heaters` once, with thermocouples and heaters in their tubes"
                )

    def _turn(self) -> str:
        """One look at everything; why the run is over, or nothing."""
        reason = self._take_samples()
        now = self._clock.now()
        if now >= self._next_control:
            self._next_control = max(self._next_control + PERIOD, now - PERIOD)
            self._control(now)
            reason = reason or self._follow_course(now)
        if now >= self._next_shown:
            self._next_shown = now + SHOWN_EVERY
            self._view.show(self._status(now))
        if now >= self._next_figures:
            self._next_figures = now + FIGURES_EVERY
            self._tell("figures", **self._figures())
            if not self._file.delay_known:
                self._tell_delay()
        return reason

    def _take_samples(self) -> str:
        for sample in self._guard.listen():
            if self._course.logging:
                self._rows.write(sample, self._guard.troubles)
            if self._rows.origin is None:
                continue
            if reason := self._stop.reason(sample, self._rows.time):
                return reason
        return ""

    def _control(self, now: float) -> None:
        if self._guard.look(now):
            self._course.restart(now)
            self._heating.off()
        limit = self._limits.operator_timeout
        alone = self._course.waiting and now - self._asked_since > limit
        off = bool(self._guard.troubles) or alone
        self._guard.command(self._heating.step(now, hold_off=off))
        self._guard.recover(now)

    def _follow_course(self, now: float) -> str:
        key = self._operator.poll()
        if key == "stop":
            raise StoppedError("stopped by the operator")
        if key == "go" and self._course.waiting:
            stage = self._course.confirm(now)
            pour_time = stage.pour_time if self._rows.origin is not None else 0.0  # over by then
            self._file.change_load(self._rows.log_time(now), self._course.load, pour_time)
            if self._weigher is not None:
                self._weigher.begin(now, stage.pour_time)
            self._tell("load", mass=self._course.load, pour_time=stage.pour_time)
        newest = self._stream.newest
        if self._guard.troubles or newest is None:
            return ""
        if not self._course.is_over(now, self._heating.stable, newest.reading):
            return ""
        self._tell("stage over", number=self._course.number)
        return self._begin_stage(now)

    def _begin_stage(self, now: float) -> str:
        stage = self._course.advance(now)
        if stage is None:
            return "all stages done"
        self._heating.aim(stage)
        self._guard.fan = stage.fan
        self._tell(
            "stage",
            number=self._course.number,
            what=describe(stage),
            note=stage.note,
            to_go=round(self._time_to_go(now), 1),
        )
        if self._course.waiting:
            assert stage.load is not None
            self._asked_since = now
            self._tell("load asked for", mass=stage.load)
            self._operator.ask(stage.load, stage.pour_time)
        return ""

    def _heaters_off(self) -> bool:
        return self._guard.heaters_off()

    def _close_notes(self, complete: bool, reason: str) -> None:
        counts, rows = self._stream.counts, self._rows
        told = [] if complete else [f"ended early: {reason}"]
        if rows.gaps:
            told.append(f"{rows.gaps} gaps, the longest {rows.longest_gap:.1f} s")
        for number, what in (
            (counts.resets, "resets of the sensor board"),
            (counts.lost, "samples lost"),
            (self._guard.recoveries, "recoveries of the heater board"),
        ):
            if number:
                told.append(f"{number} {what}")
        if told:
            self._file.note(f"Recording: {'; '.join(told)}.")

    def _figures(self) -> dict[str, Any]:
        meter = self._devices.meter.device
        return {
            "rows": self._file.rows,
            "gaps": self._rows.gaps,
            "longest_gap": round(self._rows.longest_gap, 3),
            "recoveries": self._guard.recoveries,
            "meter_garbled": None if meter is None else meter.garbled,
            **self._stream.figures(),
        }

    def _time_to_go(self, now: float) -> float:
        """Rough s until the end."""
        hottest = self._heating.hottest
        return self._course.time_to_go(now, hottest if isfinite(hottest) else 25.0)

    def _status(self, now: float) -> Status:
        course, newest, stage = self._course, self._stream.newest, self._course.stage
        board = self._devices.heater.device
        return Status(
            name=self._file.name,
            time=None if self._rows.origin is None else self._rows.time,
            rows=self._file.rows,
            channels=self._heating.channels,
            reading=None if newest is None else newest.reading,
            angle=None if newest is None else float(self._sensor.coordinate(newest.reading)),
            load=course.load,
            stage="" if stage is None else describe(stage),
            stage_number=course.number,
            stages=course.total,
            time_to_go=self._time_to_go(now),
            question=course.question,
            troubles=self._guard.troubles,
            faults=explain(board.faults) if board is not None and board.faults else "",
            lost=self._stream.counts.lost,
            resets=self._stream.counts.resets,
            fan=board is not None and bool(board.fan),
        )


def _needs(plan: RunPlan, file: RunFile, side: Literal["a", "b"]) -> bool:
    """Whether a run cannot do without a side's thermocouple."""
    element = getattr(file.metadata, f"element_{side}")
    return plan.heats(side) or element.kind == "muscle"
