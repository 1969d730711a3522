"""What every loop that records a run has in common: how it goes on, how it ends, what it tells."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import cycle
from typing import Any, Final

from muscle_bayes.bench.boards.clock import Clock
from muscle_bayes.bench.recording.guard import RecordingError
from muscle_bayes.bench.recording.rows import RowWriter
from muscle_bayes.bench.recording.run_file import RunFile
from muscle_bayes.errors import MuscleBayesError

POLLS: Final = (0.003, 0.005, 0.007, 0.004, 0.006, 0.004)
"""s between looks at the lines, by turns: at an even pace all samples might come as late as each
other, and none would tell the board's clock. 29 ms in all: whatever the stream's period, looks fall on
every millisecond of it sooner or later."""
FIRST_READING: Final = 10.0
"""s that the meter has for its first reading."""
_HEATERS: Final = {
    True: "Heaters are off;",
    False: "The heater board does not answer: it switches its heaters off by itself within 0.5 s;",
}


class StoppedError(RecordingError):
    """The operator stopped the recording."""


@dataclass(frozen=True)
class Outcome:
    """How a run went."""

    name: str
    rows: int
    duration: float
    """s between first and last row"""
    complete: bool
    reason: str
    figures: Mapping[str, Any]


class RecordingLoop:
    """Records one run on open devices; whatever ends it, the heaters go off first.

    A loop of its own kind says how it starts, what it does at each look, and how heaters go off.
    """

    _rows: RowWriter

    def __init__(self, clock: Clock, file: RunFile) -> None:
        self._clock = clock
        self._file = file
        self._begun = clock.now()

    def run(self) -> Outcome:
        """Record until it is over, or a fault ends it.

        Raises RecordingError (StoppedError where the operator ended it); the rows so far are kept.
        """
        reason, complete = "interrupted", False
        failure: MuscleBayesError | None = None
        try:
            self._start()
            pauses = cycle(POLLS)
            while not (over := self._turn()):
                self._clock.sleep(next(pauses))
            reason, complete = over, True
        except MuscleBayesError as error:
            failure, reason = error, str(error).rstrip(".")
        finally:
            off = self._heaters_off()
            with suppress(MuscleBayesError):  # on a full disk nothing more can be said
                self._tell("end", complete=complete, reason=reason, **self._figures())
                self._close_notes(complete, reason)
                self._tell_delay()
            self._file.close()
        file = self._file
        if failure is not None:
            kind = StoppedError if isinstance(failure, StoppedError) else RecordingError
            kept = f"{file.rows} rows are kept in {file.path}."
            told = kept if file.rows else "no row was recorded."
            raise kind(f"{file.name}: {reason}. {_HEATERS[off]} {told}")
        return Outcome(file.name, file.rows, self._rows.time, complete, reason, self._figures())

    def _start(self) -> None:
        """Prepare open devices. Raises MuscleBayesError."""
        raise NotImplementedError

    def _turn(self) -> str:
        """One look at everything; why the run is over, or nothing. Raises MuscleBayesError."""
        raise NotImplementedError

    def _heaters_off(self) -> bool:
        """Switch off; whether the heater board has said that it is off. Never raises."""
        raise NotImplementedError

    def _figures(self) -> Mapping[str, Any]:
        raise NotImplementedError

    def _close_notes(self, complete: bool, reason: str) -> None:
        """Add to the metadata's notes how the run went."""

    def _tell_delay(self) -> None:
        if (lag := self._rows.meter_lag.mean) is not None:
            self._file.tell_delay(lag)

    def _tell(self, kind: str, **facts: Any) -> None:
        now = self._clock.now()
        origin = self._rows.origin
        time = None if origin is None else round(now - origin, 3)
        self._file.event(kind, time=time, clock=round(now - self._begun, 3), **facts)
