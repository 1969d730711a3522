"""Files -> Run."""

from collections.abc import Sequence
from hashlib import sha256
from math import pi
from pathlib import Path

import numpy as np
import pandas as pd

from muscle_bayes.data.checking.column_units import ColumnUnit, column_units
from muscle_bayes.data.checking.magnitudes import check_magnitudes, check_position
from muscle_bayes.data.checking.stops import refuse_beyond_stops
from muscle_bayes.data.checking.unreadable import refuse_unreadable_column
from muscle_bayes.data.describing.columns import HEATER_COLUMNS
from muscle_bayes.data.describing.metadata import Metadata, parse_metadata
from muscle_bayes.data.describing.tables import CONVERTER_BITS
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.files import LOG_SUFFIXES, find_runs, log_beside, read_bytes
from muscle_bayes.data.log import RawLog, parse_any
from muscle_bayes.data.reading.cells import blank_cells, numbers
from muscle_bayes.data.reading.clock_formats import read_times
from muscle_bayes.data.repairing.clock import (
    drop_duplicates,
    refuse_falling_time,
    report_gaps,
    undo_backward_jumps,
)
from muscle_bayes.data.repairing.counters import unwrap_counter, unwrap_position
from muscle_bayes.data.repairing.faults import (
    drop_faulty,
    drop_glitches,
    drop_jumps,
    hold_last,
    hold_temperature,
)
from muscle_bayes.data.repairing.ledger import Floats, Ledger, Mask
from muscle_bayes.data.repairing.slow_columns import fill_slow_columns
from muscle_bayes.data.run import COLUMNS, Run
from muscle_bayes.data.second_log import joined, of_first, of_second
from muscle_bayes.data.units import COUNTS


def read_run(path: Path | str) -> Run:
    """Read the run of a log and its NAME.toml, given by either.

    Args:
        path: NAME.csv (or another kind of log, see LOG_SUFFIXES) or NAME.toml.

    Returns:
        The run, in SI units but for its readings, with what was repaired.

    Raises:
        RunError: with file, row, column or key, what is wrong there and how to fix it.
    """
    path = Path(path)
    if not path.suffix and not path.exists():
        raise RunError.at(path, "no such file or folder", "correct the path")
    if path.suffix.lower() not in (".toml", *LOG_SUFFIXES):
        raise RunError.at(path, "is neither NAME.csv nor NAME.toml", "name one of the run's files")
    log_path = log_beside(path) if path.suffix.lower() == ".toml" else path
    metadata_path = path.with_suffix(".toml")
    log = read_bytes(log_path)
    if not metadata_path.exists():
        fix = f"write it with `muscle-bayes init {log_path.name}`"
        raise RunError.at(metadata_path, "the run's metadata is missing", fix)
    about = read_bytes(metadata_path)
    return run_from_bytes(log, about, log_path, metadata_path)


def run_from_bytes(log: bytes, about: bytes, log_path: Path, metadata_path: Path) -> Run:
    """The run in the bytes of a log and of its metadata; paths serve name, kind and messages.

    Raises RunError.
    """
    metadata = parse_metadata(about, metadata_path)
    if metadata.thermometer_log is None:
        return _read(log, metadata, log_path, about)
    beside = log_path.parent / metadata.thermometer_log.file
    other = _read(
        read_bytes(beside, "put it there, or correct thermometer_log.file"),
        of_second(metadata),
        beside,
        b"",
    )
    return joined(_read(log, of_first(metadata), log_path, about), other, metadata)


def _read(log: bytes, metadata: Metadata, path: Path, about: bytes) -> Run:
    raw = parse_any(log, path, metadata)
    with np.errstate(over="ignore", invalid="ignore"):
        return _run(raw, metadata, path, sha256(log + about).hexdigest())


def _run(raw: RawLog, metadata: Metadata, path: Path, checksum: str) -> Run:
    units = column_units(raw, metadata)
    ledger, blank, clock = _numbers(raw)
    first_time = _first_time(ledger)
    slower = _repair(ledger, blank, metadata, units, clock)
    time = ledger.columns["time"]
    scale = _time_factor(units, clock)
    lead = float(time[0]) - first_time * scale
    if "wrapped counter" in {repair.rule for repair in ledger.repairs}:
        lead = max(lead, 0.0)
    return Run(
        name=path.stem,
        path=path,
        metadata=metadata,
        table=_table(ledger, metadata, lead),
        repairs=tuple(ledger.repairs),
        checksum=checksum,
        start=float(time[0]),
        dropped_lead=lead,
        clock=clock,
        own_times={key: times - float(time[0]) for key, times in slower.items()},
    )


def read_runs(paths: Sequence[Path | str] | Path | str) -> list[Run]:
    """Read runs, and repair by stated rules what can be repaired.

    Args:
        paths: the log or the NAME.toml of each run, or of one; a folder stands for every run in it,
            sorted.

    Returns:
        The runs, in the order in which they were named. Readings are in the log's own unit, times in
        s, temperatures in C, loads in kg; `repairs` says what was repaired.

    Raises:
        RunError: where a file cannot be read as a run; the message says where and what to do. It is
            a MuscleBayesError.

    Example:
        >>> import muscle_bayes as mb
        >>> path = mb.load_example("spring-1")[0].path
        >>> (run,) = mb.read_runs([path])
        >>> run.name, len(run.table), run.repairs
        ('spring-1', 181, ())
    """
    return [read_run(path) for path in find_runs(paths)]


def _numbers(raw: RawLog) -> tuple[Ledger, dict[str, Mask], str]:
    """Numbers of all columns, which cells are blank, and the format of the time column."""
    layout, columns = raw.layout, {}
    clock = "number"
    for key, cells in raw.cells.items():
        if key == "time":
            times = read_times(cells, layout.time_format, layout.decimal, layout.thousands)
            columns[key], clock = times.values, times.kind
        else:
            columns[key] = numbers(cells, layout.decimal, layout.thousands)
        refuse_unreadable_column(cells, columns[key], raw.lines, raw.path, raw.columns[key], layout)
    names = dict(raw.columns)
    if "reading" not in columns:
        columns["reading"] = np.zeros(len(raw.lines))
        names["reading"] = "no position"
    if layout.sample_rate is not None:
        columns["time"] = np.asarray(raw.ordinals, dtype=np.float64) / layout.sample_rate
        names["time"], clock = "the sample rate", "rate"
    lines = np.asarray(raw.lines, dtype=np.int64)
    blank = {key: blank_cells(cells) for key, cells in raw.cells.items()}
    ledger = Ledger(raw.path, names, columns, lines, list(raw.repairs), set(raw.unreadable))
    return ledger, blank, clock


def _first_time(ledger: Ledger) -> float:
    """Time of the log's first row, whose other cells may be bad, in the log's own unit."""
    times = ledger.columns["time"]
    good = times[np.isfinite(times)]
    return float(good[0]) if good.size else 0.0


def _time_factor(units: dict[str, ColumnUnit], clock: str) -> float:
    """s in one of the time column's unit; clocks and a sample rate give seconds."""
    return units["time"].unit.factor if clock == "number" and "time" in units else 1.0


def _repair(
    ledger: Ledger,
    blank: dict[str, Mask],
    metadata: Metadata,
    units: dict[str, ColumnUnit],
    clock: str,
) -> dict[str, Floats]:
    """Make every column good, in SI units but for readings; times of slower sensors' readings."""
    for key in ("setpoint_a", "setpoint_b", "temperature_b", "temperature_a"):
        _drop_empty_column(ledger, metadata, key)
    bad_time = ~np.isfinite(ledger.columns["time"])
    drop_faulty(ledger, "time")
    _refuse_few_rows(ledger)
    blank = {key: mask[~bad_time] for key, mask in blank.items()}
    unwrap_counter(ledger, clock)
    _to_si(ledger, units, clock)
    if metadata.columns is not None and "applied" in ledger.columns:
        ledger.columns["applied"] = metadata.columns.applied_sign * ledger.columns["applied"]
    refuse_falling_time(ledger)
    check_magnitudes(ledger, units, metadata, clock)
    measured = {key: mask for key, mask in blank.items() if key not in HEATER_COLUMNS}
    slower = fill_slow_columns(ledger, measured)
    for key in ("reading", "force", "applied", "power_a", "power_b"):
        if key in ledger.columns:
            drop_faulty(ledger, key)
    _refuse_few_rows(ledger)
    if metadata.position_unit == COUNTS and metadata.potentiometer is not None:
        potentiometer = metadata.potentiometer
        step = potentiometer.resolution or 1.0
        drop_glitches(ledger, potentiometer.bits or CONVERTER_BITS, step)
        if potentiometer.bits is not None:  # an encoder's counter; else the fixture's potentiometer
            period = 2.0**potentiometer.bits
            unwrap_position(ledger, period, "wrapped counter", "period of the counter")
    if metadata.output.kind == "angle":
        unwrap_position(ledger, 2 * pi / metadata.output.factor, "wrapped angle", "turn")
    drop_jumps(ledger)
    check_position(ledger, units, metadata)
    for key in ("temperature_a", "temperature_b"):
        if key in ledger.columns:
            hold_temperature(ledger, key)
    for key in ("setpoint_a", "setpoint_b", "load"):
        if key in ledger.columns:
            faulty = ~np.isfinite(ledger.columns[key])
            hold_last(ledger, key, faulty, "bad cell", "blank or no finite number")
    drop_duplicates(ledger)
    undo_backward_jumps(ledger)
    report_gaps(ledger)
    _refuse_negative_load(ledger)
    refuse_beyond_stops(ledger, metadata)
    _refuse_few_rows(ledger)
    return slower


def _to_si(ledger: Ledger, units: dict[str, ColumnUnit], clock: str) -> None:
    """Columns in s, C, kg, and N, N m, A, V or duty; readings stay as logged."""
    for key, column in units.items():
        if key in ("reading", "force") or key not in ledger.columns:
            continue
        if key == "time" and clock != "number":
            continue
        unit = column.unit
        if (unit.factor, unit.offset) != (1.0, 0.0):
            ledger.columns[key] = ledger.columns[key] * unit.factor + unit.offset


def _refuse_few_rows(ledger: Ledger) -> None:
    if ledger.lines.size < 2:
        raise ledger.refusal(f"{ledger.lines.size} good rows", "give a log with two rows or more")


def _drop_empty_column(ledger: Ledger, metadata: Metadata, key: str) -> None:
    """A setpoint, or a temperature that no muscle needs, may be blank throughout."""
    values = ledger.columns.get(key)
    if values is None or np.isfinite(values).any():
        return
    kind = getattr(metadata, f"element_{key[-1]}").kind
    if key.startswith("temperature") and kind == "muscle":
        problem = f"no temperature in the whole column, and element_{key[-1]} is a muscle"
        raise ledger.refusal(problem, "give its temperatures", 0, key)
    del ledger.columns[key]


def _refuse_negative_load(ledger: Ledger) -> None:
    load = ledger.columns.get("load")
    if load is not None and (load < 0).any():
        problem = f"load of {load[load < 0][0]:g} kg is negative"
        raise ledger.refusal(problem, "give masses of 0 kg or more", load < 0, "load")


def _table(ledger: Ledger, metadata: Metadata, dropped_lead: float) -> pd.DataFrame:
    columns = dict(ledger.columns)
    columns["time"] = columns["time"] - columns["time"][0]
    if metadata.load is not None:
        columns["load"] = _load_at(columns["time"] + dropped_lead, metadata)
    room = metadata.fixture.room_temperature
    absent = {"temperature_a": room, "temperature_b": room, "load": 0.0, "applied": 0.0}
    rows = ledger.lines.size
    return pd.DataFrame(
        {key: columns.get(key, np.full(rows, absent.get(key, np.nan))) for key in COLUMNS}
    )


def _load_at(time: np.ndarray, metadata: Metadata) -> np.ndarray:
    """Load [kg] at times [s after the log's first row]; none before the table's first step."""
    assert metadata.load is not None
    step = np.searchsorted(np.asarray(metadata.load.time), time, side="right")
    return np.concatenate([[0.0], metadata.load.mass])[step]
