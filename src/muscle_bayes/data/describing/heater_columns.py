"""What the heater board did in each row: columns that a log may have behind the bench's own."""

from collections.abc import Mapping, Sequence
from typing import Final

HEATER_HEADER: Final = ("Duty A", "Duty B", "Faults", "Fan")
"""Duty of each heater, of 255, the board's latched faults and its fan (0 or 1), as the board said last
before the row; blank while it did not answer."""

HEATER_COLUMNS: Final = ("duty_a", "duty_b", "faults", "fan")
"""Their names in a run's table; NaN where a cell is blank or the log has no such column."""


def with_heater_columns(
    names: Mapping[str, str | int], header: Sequence[str], *, own: bool
) -> dict[str, str | int]:
    """Names of a log's columns, with those of the heater where its header has them once.

    `own`: the log has the bench's own header, and no [columns].
    """
    found = {
        key: name
        for key, name in zip(HEATER_COLUMNS, HEATER_HEADER, strict=True)
        if own and header.count(name) == 1
    }
    return {**names, **found}
