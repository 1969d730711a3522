"""Numbers that no such rig has in the unit in which they are read: the unit is asked for."""

from collections.abc import Callable
from typing import Final

import numpy as np

from muscle_bayes.data.checking.column_units import ColumnUnit, ask_for
from muscle_bayes.data.describing.metadata import Metadata
from muscle_bayes.data.describing.sizes import MOST_LOAD
from muscle_bayes.data.repairing.ledger import Floats, Ledger
from muscle_bayes.data.units import COUNTS

COLDEST_HOT: Final = 45.0
"""C; a log whose low readings are above this, and a room's in another unit, is asked about."""
ROOM: Final = (-5.0, 45.0)
"""Temperatures at which a rig may stand, C."""
SLOWEST: Final = 5.0
"""Usual spacing of rows in whole numbers from which milliseconds are suspected, s."""
FASTEST: Final = 2e-6
"""Usual spacing of rows below which another unit of time is suspected, s."""
EPOCH_MS: Final = 1e11
"""Unix times above this lie in the year 5138, or are milliseconds, s."""
FARTHEST: Final = 100.0
"""Travel of a linear rig, m."""
STRONGEST: Final = {"linear": 1e5, "rotary": 1e4}
"""Applied force, N, or torque, N m."""


def check_magnitudes(
    ledger: Ledger, units: dict[str, ColumnUnit], metadata: Metadata, clock: str
) -> None:
    """Ask for the unit of columns whose numbers no such rig has.

    Args:
        ledger: columns in SI (temperatures in C, readings in their own unit).
        units: unit of each column.
        metadata: of the run.
        clock: format of the time column, see `read_times`.

    Raises:
        RunError: names column, key and the unit that the numbers suggest.
    """
    checks: dict[str, Callable[[Floats, Metadata], str]] = {
        "temperature_a": _temperature,
        "temperature_b": _temperature,
        "load": _load,
        "applied": _applied,
    }
    if clock == "number":
        checks["time"] = _time
    for key, check in checks.items():
        column = units.get(key)
        values = ledger.columns.get(key)
        if column is None or values is None or column.stated or column.confirmed:
            continue
        if column.accepted:
            continue
        values = values[np.isfinite(values)]
        if values.size and (problem := check(values, metadata)):
            _ask(ledger, key, column, problem, metadata)


def check_position(ledger: Ledger, units: dict[str, ColumnUnit], metadata: Metadata) -> None:
    """Ask for the unit of positions that no such rig has; failed readings must be out of them.

    Raises:
        RunError: names column, key and what is wrong.
    """
    reading = units.get("reading")
    if (
        reading is not None
        and not reading.accepted
        and metadata.measured == "position"
        and metadata.position_unit != COUNTS  # a converter's counts lie within its bits
    ):
        values = ledger.columns["reading"]
        values = values[np.isfinite(values)] * reading.unit.factor
        if values.size and (problem := _position(values, metadata)):
            _ask(ledger, "reading", reading, problem, metadata)


def _ask(ledger: Ledger, key: str, column: ColumnUnit, problem: str, metadata: Metadata) -> None:
    fix = ask_for(key, column, metadata)
    raise ledger.refusal(problem, fix, None, key, f"columns.{column.key}")


def _time(time: Floats, metadata: Metadata) -> str:
    spacing = np.abs(np.diff(time))
    spacing = spacing[spacing > 0]
    usual = float(np.median(spacing)) if spacing.size else 1.0
    if time[0] > EPOCH_MS:
        unit = "ms" if time[0] < 1e14 else "us" if time[0] < 1e17 else "ns"
        return f"{time[0]:.13g} s is no date; it is one in {unit} since 1970"
    if usual >= SLOWEST and bool(np.all(time == np.rint(time))):
        return f"rows lie {usual:g} s apart in whole numbers, as milliseconds do"
    if usual < FASTEST:
        return f"rows lie {usual:.3g} s apart, as hours or days do"
    return ""


def likely_temperature(values: Floats) -> str:
    """The unit in which temperatures are those of a rig, where they are not in degrees C."""
    values = values[np.isfinite(values)]
    low = float(np.percentile(values, 5)) if values.size else 0.0
    if low > 200.0 and low - 273.15 > -50.0:
        return "kelvin"
    return "degF" if low > COLDEST_HOT and ROOM[0] < (low - 32.0) / 1.8 < ROOM[1] else ""


def _temperature(values: Floats, metadata: Metadata) -> str:
    low, high = np.percentile(values, [5, 95])
    unit = likely_temperature(values)
    if unit == "kelvin":
        return f"temperatures of {low:.4g} to {high:.4g} are no degrees C; kelvin fit"
    if unit == "degF":
        return (
            f"temperatures never fall below {low:.4g}, which is no room's in C; "
            f"in degrees F it is {(low - 32.0) / 1.8:.3g} C"
        )
    return ""


def _load(values: Floats, metadata: Metadata) -> str:
    heaviest = float(np.percentile(values, 95))
    if heaviest > MOST_LOAD:
        return f"a load of {heaviest:g} kg is heavier than what such rigs carry; grams fit"
    return ""


def _applied(values: Floats, metadata: Metadata) -> str:
    if metadata.drive_unit.kind not in ("force", "torque"):
        return ""
    limit = STRONGEST[metadata.fixture.motion]
    strongest = float(np.percentile(np.abs(values), 99))
    if strongest > limit:
        unit = "N" if metadata.fixture.motion == "linear" else "N m"
        return f"{strongest:.4g} {unit} is more than such rigs are driven with, {limit:g} {unit}"
    return ""


def _position(q: Floats, metadata: Metadata) -> str:
    span = float(np.max(q) - np.min(q))
    if not np.isfinite(span):
        return "positions are too large for any unit"
    if metadata.fixture.motion == "linear":
        if span > FARTHEST:
            return f"the position moves by {span:.4g} m, more than such rigs do"
        return ""
    kinds = {metadata.element_a.kind, metadata.element_b.kind}
    pinned = any(
        getattr(element, "linkage", None) == "pins"
        for element in (metadata.element_a, metadata.element_b)
    )
    if pinned and span > 4 * np.pi:
        return f"the rotor turns by {span:.4g} rad, but an element linked by pins lets it turn once"
    driven = metadata.columns is not None and metadata.columns.applied is not None
    if "arm" in kinds and kinds <= {"arm", "none"} and not driven and _swings_wider(q, 2 * np.pi):
        return (
            f"the arm swings to and fro by {span:.4g} rad; a pendulum that nothing drives turns "
            "by less than 6.3 rad between reversals"
        )
    return ""


def _swings_wider(q: Floats, limit: float) -> bool:
    """Whether q rises by more than `limit` and then falls by as much, or the other way round."""
    for values in (q, -q):
        risen = values - np.minimum.accumulate(values)
        falls = values - np.minimum.accumulate(values[::-1])[::-1]
        if bool(np.any((risen > limit) & (falls > limit))):
            return True
    return False
