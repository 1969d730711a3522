"""The rules by which faulty cells of a log are repaired."""

import numpy as np

from muscle_bayes.data.repairing.jumps import find_frozen, find_jumps
from muscle_bayes.data.repairing.ledger import Ledger, Mask

TEMPERATURE_FLOOR = 0.5
"""Change between two readings that any thermometer may show, C."""
FAILURES = (-1.0, 0.0, 85.0, -127.0, 127.0)
"""What thermometers show when they have failed, C: Artisan's devices, MAX6675, DS18B20."""


def drop_faulty(ledger: Ledger, key: str) -> None:
    """A time, position or applied force that is no finite number: the row is dropped."""
    mask = ~np.isfinite(ledger.columns[key])
    ledger.record(
        "bad cell", mask, f"column {ledger.names[key]!r} blank or no finite number: row dropped"
    )
    ledger.drop(mask)


def hold_last(ledger: Ledger, key: str, faulty: Mask, rule: str, what: str) -> None:
    """A slow quantity that is missing: hold the last good value (before the first, the first)."""
    ledger.record(rule, faulty, f"column {ledger.names[key]!r} {what}: last value held")
    if not faulty.any():
        return
    good = np.flatnonzero(~faulty)
    source = good[np.maximum(np.searchsorted(good, np.arange(faulty.size), side="right") - 1, 0)]
    ledger.columns[key] = ledger.columns[key][source]


def hold_temperature(ledger: Ledger, key: str) -> None:
    """Blank cells, and readings that only an open thermocouple gives, hold the last value."""
    values = ledger.columns[key]
    hold_last(ledger, key, ~np.isfinite(values), "bad cell", "blank or no finite number")
    values = ledger.columns[key]
    hold_last(ledger, key, (values < -60) | (values > 500), "wild temperature", "beyond -60..500 C")
    jumped = find_jumps(ledger.columns[key], floor=TEMPERATURE_FLOOR, failures=FAILURES)
    what = "jumps and comes back at once, faster than it ever changes: a failed reading"
    hold_last(ledger, key, jumped, "impossible jump", what)
    frozen = find_frozen(ledger.columns[key], floor=TEMPERATURE_FLOOR)
    name = ledger.names[key]
    ledger.note("frozen", frozen, f"column {name!r} stands still, then jumps: the value is not new")


def drop_jumps(ledger: Ledger) -> None:
    """A position that jumps and comes back at once, faster than it ever moves: the row is dropped."""
    mask = find_jumps(ledger.columns["reading"])
    name = ledger.names["reading"]
    what = "jumps and comes back at once, faster than it ever moves: row dropped"
    ledger.record("impossible jump", mask, f"column {name!r} {what}")
    ledger.drop(mask)


def drop_glitches(ledger: Ledger, bits: int, step: float = 1.0) -> None:
    """A reading that no such converter gives: one in a thousand rows is dropped, more refused.

    Args:
        ledger: columns under repair.
        bits: of the converter.
        step: of the readings, counts; below 1 where conversions were averaged.

    Raises:
        RunError: more than a few readings are none.
    """
    reading = ledger.columns["reading"]
    few, most = max(1, ledger.total // 1000), 2**bits - 1
    signed = np.sum(reading < 0) > few and reading.min() >= -(2 ** (bits - 1))
    if signed:  # two's complement, as an encoder's counter
        most = 2 ** (bits - 1) - 1
    low = -most - 1 if signed else 0
    off = np.abs(reading - np.rint(reading / step) * step)
    mask = (reading < low) | (reading > most) | (off > (0.0 if step == 1.0 else 1e-6))
    if mask.sum() > few:
        raise ledger.refusal(
            f"{reading[mask][0]:g} is no {bits}-bit count, and {mask.sum()} rows have such readings",
            f"log whole counts of {low}..{most}, give the converter's potentiometer.bits, or set "
            "columns.position_unit to the unit it is in",
            mask,
            "reading",
        )
    name = ledger.names["reading"]
    ledger.record(
        "glitch", mask, f"column {name!r} is no whole count of {low}..{most}: row dropped"
    )
    ledger.drop(mask)
