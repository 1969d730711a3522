"""Temperatures that another instrument logged, in a file and on a clock of its own."""

from dataclasses import replace

import numpy as np

from muscle_bayes.data.describing.columns import Columns
from muscle_bayes.data.describing.log_format import LogFormat
from muscle_bayes.data.describing.metadata import Metadata
from muscle_bayes.data.describing.tables import Thermometer
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.repairing.ledger import Floats, Repair
from muscle_bayes.data.run import Run

ALIGNED = 5.0
"""Standard uncertainty of an offset that was found by aligning both logs, s."""
_COVERED = 0.6
"""Least share of the log's time for which the other holds temperatures."""
_BINS = 1000
"""Means of the log that are aligned, at most."""
_OFFSETS = 2000
"""Offsets that are tried."""
_TEMPERATURES = ("temperature_a", "temperature_b")


def of_first(metadata: Metadata) -> Metadata:
    """What the metadata say of the log of positions: its columns without temperatures."""
    assert metadata.columns is not None, "Metadata guarantees columns beside another log"
    columns = metadata.columns.model_copy(update=dict.fromkeys(_TEMPERATURES))
    return metadata.model_copy(update={"columns": columns})


def of_second(metadata: Metadata) -> Metadata:
    """What the metadata say of the log of temperatures."""
    second, columns = metadata.thermometer_log, metadata.columns
    assert second is not None, "asked only where there is another log"
    assert columns is not None, "Metadata guarantees columns beside another log"
    kept = {key: getattr(columns, key) for key in (*_TEMPERATURES, "temperature_unit")}
    own = Columns(time=second.time, time_unit=second.time_unit, **kept)
    nothing = {"load": None, "drive": None, "potentiometer": None}
    log = second.log or LogFormat()
    own = own.model_copy(update={"position_unit": "rad"})
    return metadata.model_copy(update={"columns": own, "log": log, **nothing})


def joined(first: Run, second: Run, metadata: Metadata) -> Run:
    """A run with the temperatures of another log on its rows, and its repairs beside its own.

    An offset that is not stated is the one at which changes of temperature explain those of the readings
    best. What it is off by stays open within ALIGNED: fits estimate it (`clock-offset`).

    Raises:
        RunError: the other log does not cover the run's time.
    """
    table = metadata.thermometer_log
    assert table is not None, "asked only where there is another log"
    at = first.start + first.table["time"].to_numpy()
    when = second.start + second.table["time"].to_numpy()
    offset, meter = table.offset, metadata.thermometer
    if offset is None:
        offset = _aligned(first, second, at, when)
        meter = meter or Thermometer(delay_uncertainty=ALIGNED)
    shifted = at + offset
    covered = float(np.mean((shifted >= when[0]) & (shifted <= when[-1])))
    if covered < _COVERED:
        raise RunError.at(
            second.path or table.file,
            f"holds temperatures for {covered:.0%} of the log's time, with a clock that is "
            f"{offset:.6g} s ahead",
            "correct thermometer_log.offset, or leave it out to have it found",
            key="thermometer_log.offset",
        )
    temperatures = {
        key: np.interp(shifted, when, second.table[key])
        for key in _TEMPERATURES
        if getattr(metadata.columns, key) is not None
    }
    found = "as stated" if table.offset is not None else "by aligning both logs"
    note = f"{table.file}: {when.size} temperatures; its clock is {offset:.6g} s ahead, {found}"
    return replace(
        first,
        metadata=metadata.model_copy(update={"thermometer": meter}),
        table=first.table.assign(**temperatures),
        repairs=(*first.repairs, *second.repairs, Repair("joined log", 1, 1, note)),
        checksum=f"{first.checksum}+{second.checksum}",
    )


def _aligned(first: Run, second: Run, at: Floats, when: Floats) -> float:
    """The offset [s] at which the other log's temperature explains most of how the readings change."""
    shown = first.table["force" if first.has_force else "reading"].to_numpy()
    heat = next(
        second.table[key].to_numpy() for key in _TEMPERATURES if np.ptp(second.table[key]) > 0.0
    )
    parts = min(at.size, _BINS)
    at, shown = (
        np.array([part.mean() for part in np.array_split(values, parts)]) for values in (at, shown)
    )
    need = _COVERED * (at[-1] - at[0])
    offsets = np.linspace(when[0] + need - at[-1], when[-1] - need - at[0], _OFFSETS)
    for _ in range(2):
        left = [_unexplained(np.interp(at + offset, when, heat), shown) for offset in offsets]
        best = offsets[int(np.argmin(left))]
        offsets = best + np.linspace(-2.0, 2.0, 81) * (offsets[1] - offsets[0])
    return float(best)


def _unexplained(heat: Floats, shown: Floats) -> float:
    """Squared residual of changes of the readings, by those of a parabola in temperature.

    Changes, because readings also creep and stick.
    """
    x = (heat - heat.mean()) / max(float(np.ptp(heat)), 1e-9)
    changed = np.diff(shown)
    basis = np.diff(np.stack([x, x**2], axis=1), axis=0)
    rest = changed - basis @ np.linalg.lstsq(basis, changed, rcond=None)[0]
    return float(rest @ rest)
