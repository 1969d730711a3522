"""A run on disk while it is being recorded: nothing that was written is ever touched again."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from math import ceil
from pathlib import Path
from typing import Any, Final

from muscle_bayes.bench.boards.messages import AVERAGED
from muscle_bayes.bench.recording.log_row import LOG_HEADER, TIME_DECIMALS, Row, format_row
from muscle_bayes.data import Load, Metadata, Thermometer
from muscle_bayes.data.events import EVENTS_SUFFIX
from muscle_bayes.data.events import read_events as read_events
from muscle_bayes.data.writer import to_toml
from muscle_bayes.errors import MuscleBayesError

POUR_STEP: Final = 0.05
"""s between the steps by which a pour is told: short against a rotor's swings. Steps as long as these
would jolt a simulated rotor, which would then stick elsewhere than the real one (by a quarter of a count
in a sawtooth that was tried)."""
DELAY_UNCERTAINTY: Final = 0.2
"""Standard uncertainty of a measured delay, s: half the time between two measurements of the meter. The
host sees when digits come, not when within that time they were measured."""
RESOLUTION: Final = 1 / AVERAGED
"""Step of the readings, counts: each is a mean of eight conversions."""
UNKNOWN_DELAY: Final = 0.3
"""Standard uncertainty of the delay before it is measured, s."""
_MASS_DECIMALS: Final = 6


class RunFileError(MuscleBayesError):
    """A run that cannot be written, or whose name is taken."""


class RunFile:
    """NAME.toml, NAME.csv and NAME.events.jsonl of one run.

    The metadata is written first and replaced as a whole when the load changes or more is known. The log
    appears with its first two rows (the reader needs them), and from then on every row is one write of a
    whole line that the system holds before `append` returns: a kill loses at most one row. A write that
    fails, as on a full disk, is taken back to the end of the last whole row.
    """

    def __init__(self, folder: Path, name: str, metadata: Metadata) -> None:
        """Raises RunFileError where the name is taken or nothing can be written."""
        self.more: tuple[str, ...] = ()
        """columns besides LOG_HEADER, to be set before the first row"""
        self._load_before: Load | None = None
        self._load_change = (0.0, 0.0)
        self.name = name
        self.path = folder / f"{name}.csv"
        self.metadata = _as_recorded(metadata)
        self.rows = 0
        self._first = b""
        self._log: _Lines | None = None
        with self._told():
            folder.mkdir(parents=True, exist_ok=True)
            if any(path.exists() for path in run_files(folder, name)):
                raise RunFileError(
                    f"{self.path}: a run of this name exists. "
                    "Fix: choose another --out or name; a recorded run is never replaced."
                )
            self._write_metadata()
            self._events = _Lines(self.path.with_suffix(EVENTS_SUFFIX))

    def append(self, row: Row) -> None:
        """Write a row. Raises RunFileError; the rows before it stay whole."""
        line = format_row(row, self.more)
        with self._told():
            if self._log is not None:
                self._log.write(line)
                self.rows += 1
            elif not self._first:
                self._first = line
            else:
                self._log = self._begin(self._first + line)
                self.rows = 2

    def event(self, kind: str, **facts: Any) -> None:
        """Write down what happened. Raises RunFileError."""
        line = json.dumps({"event": kind, **facts}, ensure_ascii=False, allow_nan=False) + "\n"
        with self._told():
            self._events.write(line.encode())

    def change_load(self, time: float, mass: float, pour_time: float = 0.0) -> None:
        """The load becomes `mass` [kg], from a time [s after the first row] on, poured evenly.

        A pour is told in steps of POUR_STEP at most. Raises RunFileError.
        """
        load = self.metadata.load
        assert load is not None, "a run that is recorded has a load table"
        self._load_before, self._load_change = load, (time, pour_time)
        before = load.mass[-1]
        count = max(ceil(pour_time / POUR_STEP), 1)
        steps = dict(zip(load.time, load.mass, strict=True))
        for number in range(count):
            at = round(time + (number + 0.5) / count * pour_time, TIME_DECIMALS)
            reached = (
                mass if number + 1 == count else before + (mass - before) * (number + 1) / count
            )
            steps[max(at, load.time[-1])] = round(reached, _MASS_DECIMALS)
        self._amend(load=Load(time=tuple(steps), mass=tuple(steps.values())))

    def correct_load(self, mass: float) -> None:
        """The load that was changed to last, or hung at first, is `mass` [kg]. Raises RunFileError."""
        if self._load_before is None:
            self._amend(load=Load(time=(0.0,), mass=(round(max(mass, 0.0), _MASS_DECIMALS),)))
            return
        time, pour_time = self._load_change
        self._amend(load=self._load_before)
        self.change_load(time, max(mass, 0.0), pour_time)

    def read_by_encoder(self) -> None:
        """The readings are whole counts of an encoder. Raises RunFileError."""
        told = self.metadata.potentiometer
        if told is not None:
            whole = {"resolution": 1.0, "bits": told.bits or 16}
            self._amend(potentiometer=told.model_copy(update=whole))

    def tell_delay(self, delay: float) -> None:
        """Temperatures are logged `delay` [s] later than readings. Raises RunFileError."""
        delay = round(delay, TIME_DECIMALS)
        self._amend(thermometer=Thermometer(delay=delay, delay_uncertainty=DELAY_UNCERTAINTY))

    @property
    def delay_known(self) -> bool:
        """Whether the metadata say by how much temperatures are late."""
        return self.metadata.thermometer is not None and self.metadata.thermometer.delay is not None

    def note(self, text: str) -> None:
        """Add a sentence to the metadata's notes. Raises RunFileError."""
        self._amend(notes=" ".join(filter(None, (self.metadata.notes, text))))

    def close(self) -> None:
        """Hand everything to the disk and let go of the files; never raises."""
        for lines in (self._log, self._events):
            if lines is not None:
                lines.close()
        self._log = None

    def _begin(self, rows: bytes) -> "_Lines":
        partial = self.path.with_name(f".{self.path.name}.part")
        try:
            log = _Lines(partial)
            log.write((", ".join((*LOG_HEADER, *self.more)) + "\n").encode() + rows)
            partial.rename(self.path)
        except OSError:
            partial.unlink(missing_ok=True)
            raise
        return log

    def _amend(self, **tables: Any) -> None:
        before = self.metadata
        self.metadata = before.model_copy(update=tables)
        try:
            with self._told():
                self._write_metadata()
        except RunFileError:
            self.metadata = before
            raise

    def _write_metadata(self) -> None:
        path = self.path.with_suffix(".toml")
        partial = path.with_name(f".{path.name}.part")
        try:
            partial.write_bytes(to_toml(self.metadata).encode())
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)

    @contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise RunFileError(
                f"{self.path}: cannot be written: {error.strerror or error}. The {self.rows} rows "
                "before are kept. Fix: free space on the disk, or choose another --out."
            ) from None


class _Lines:
    """A new file to which whole lines are added."""

    def __init__(self, path: Path) -> None:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | getattr(os, "O_BINARY", 0)
        self._descriptor = os.open(path, flags, 0o666)
        self._length = 0

    def write(self, content: bytes) -> None:
        """Add all of `content`, or nothing of it and raise OSError."""
        try:
            rest = memoryview(content)
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._descriptor, self._length)
            raise
        self._length += len(content)

    def close(self) -> None:
        with suppress(OSError):
            os.fsync(self._descriptor)
        with suppress(OSError):
            os.close(self._descriptor)


def _as_recorded(metadata: Metadata) -> Metadata:
    """With what this recorder's logs are: readings in eighths, temperatures late by an unknown time.

    Nobody has measured the meter's delay yet; a run that is killed now must not say zero.
    """
    tables: dict[str, Any] = {}
    if metadata.potentiometer is not None:
        finer = {"resolution": RESOLUTION}
        tables["potentiometer"] = metadata.potentiometer.model_copy(update=finer)
    if metadata.thermometer is None:
        tables["thermometer"] = Thermometer(delay_uncertainty=UNKNOWN_DELAY)
    return metadata.model_copy(update=tables)


def run_files(folder: Path, name: str) -> tuple[Path, Path, Path]:
    """Log, metadata and events of a run."""
    log = folder / f"{name}.csv"
    return log, log.with_suffix(".toml"), log.with_suffix(EVENTS_SUFFIX)


def free_name(folder: Path, name: str) -> str:
    """`name`, or NAME-again, NAME-again-2, ... where attempts that were cut short have it."""
    tried, number = name, 1
    while any(path.exists() for path in run_files(folder, tried)):
        tried = f"{name}-again" + (f"-{number}" if number > 1 else "")
        number += 1
    return tried
