"""Files -> Run."""

from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

import numpy as np
import pandas as pd

from muscle_bayes.data.cells import numbers
from muscle_bayes.data.clock import drop_duplicates, mend_backward_jumps, report_gaps
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.files import read_bytes
from muscle_bayes.data.log import RawLog, parse_log
from muscle_bayes.data.metadata import Metadata
from muscle_bayes.data.metadata_file import parse_metadata
from muscle_bayes.data.repair import Ledger, drop_faulty, drop_glitches, hold_last, hold_temperature
from muscle_bayes.data.run import COLUMNS, Run


def read_run(path: Path | str) -> Run:
    """Read the run of NAME.csv and NAME.toml, given by either. Raises RunError."""
    path = Path(path)
    if not path.suffix and not path.exists():
        raise RunError.at(path, "no such file or folder", "correct the path")
    if path.suffix not in (".csv", ".toml"):
        raise RunError.at(path, "is neither NAME.csv nor NAME.toml", "name one of the run's files")
    log_path, metadata_path = path.with_suffix(".csv"), path.with_suffix(".toml")
    log = read_bytes(log_path, "the run's log")
    about = read_bytes(metadata_path, "the run's metadata")
    metadata = parse_metadata(about, metadata_path)
    ledger = _numbers(parse_log(log, log_path, metadata.columns))
    first_time = _first_time(ledger)
    _repair(ledger, metadata)
    time = ledger.columns["time"]
    return Run(
        name=path.stem,
        path=log_path,
        metadata=metadata,
        table=_table(ledger, metadata, float(time[0]) - first_time),
        repairs=tuple(ledger.repairs),
        checksum=sha256(log + about).hexdigest(),
        start=float(time[0]),
        dropped_lead=float(time[0]) - first_time,
    )


def read_runs(paths: Sequence[Path | str]) -> list[Run]:
    """Read runs, and repair by stated rules what can be repaired.

    Args:
        paths: NAME.csv or NAME.toml of each run; a folder stands for every CSV in it, sorted.

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


def find_runs(paths: Sequence[Path | str]) -> list[Path]:
    """The log of every run named. Raises RunError where there is none or two share a name."""
    logs: list[Path] = []
    for path in map(Path, paths):
        found = sorted(path.glob("*.csv")) if path.is_dir() else [path]
        if not found:
            raise RunError.at(path, "no runs: the folder holds no CSV", "name a folder of runs")
        logs += [log.with_suffix(".csv") if log.suffix == ".toml" else log for log in found]
    if not logs:
        raise RunError("No runs were named. Mend: name a run or a folder of runs.")
    logs = list(dict.fromkeys(logs))  # NAME.csv and NAME.toml both named are one run
    seen: dict[str, Path] = {}
    for log in logs:
        if (other := seen.setdefault(log.stem, log)) is not log:
            raise RunError.at(log, f"duplicate run name, {other} has it too", "rename one of them")
    return logs


def _numbers(raw: RawLog) -> Ledger:
    columns = {key: numbers(cells) for key, cells in raw.cells.items()}
    lines = np.asarray(raw.lines, dtype=np.int64)
    return Ledger(raw.path, raw.columns, columns, lines, list(raw.repairs), set(raw.unreadable))


def _first_time(ledger: Ledger) -> float:
    """Time of the log's first row, whose other cells may be bad."""
    times = ledger.columns["time"]
    good = times[np.isfinite(times)]
    return float(good[0]) if good.size else 0.0


def _repair(ledger: Ledger, metadata: Metadata) -> None:
    for key in ("setpoint_a", "setpoint_b", "temperature_b", "temperature_a"):
        _drop_empty_column(ledger, metadata, key)
    for key in ("time", "reading", "applied"):
        if key in ledger.columns:
            drop_faulty(ledger, key)
    if metadata.position_unit == "counts":
        drop_glitches(ledger)
    for key in ("temperature_a", "temperature_b"):
        if key in ledger.columns:
            hold_temperature(ledger, key)
    for key in ("setpoint_a", "setpoint_b", "load"):
        if key in ledger.columns:
            faulty = ~np.isfinite(ledger.columns[key])
            hold_last(ledger, key, faulty, "bad cell", "blank or no finite number")
    drop_duplicates(ledger)
    mend_backward_jumps(ledger)
    report_gaps(ledger)
    _refuse_negative_load(ledger)
    if ledger.lines.size < 2:
        raise RunError.at(
            ledger.path, f"{ledger.lines.size} good rows", "give a log with two rows or more"
        )


def _drop_empty_column(ledger: Ledger, metadata: Metadata, key: str) -> None:
    """A setpoint, or a temperature that no muscle needs, may be blank throughout."""
    values = ledger.columns.get(key)
    if values is None or np.isfinite(values).any():
        return
    kind = getattr(metadata, f"element_{key[-1]}").kind
    if key.startswith("temperature") and kind == "muscle":
        raise RunError.at(
            ledger.path,
            f"no temperature in the whole column, and element_{key[-1]} is a muscle",
            "give its temperatures",
            row=int(ledger.lines[0]),
            column=ledger.names[key],
        )
    del ledger.columns[key]


def _refuse_negative_load(ledger: Ledger) -> None:
    load = ledger.columns.get("load")
    if load is not None and (load < 0).any():
        row = int(np.flatnonzero(load < 0)[0])
        raise RunError.at(
            ledger.path,
            f"load of {load[row]:g} kg is negative",
            "give masses of 0 kg or more",
            row=int(ledger.lines[row]),
            column=ledger.names["load"],
        )


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
