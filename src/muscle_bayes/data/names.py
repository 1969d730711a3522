"""How NAME.toml names a column of the log: by its header, or by its number."""

from typing import Annotated, Any

from pydantic import PlainValidator


def _checked(value: Any) -> str | int:
    if isinstance(value, str) and value.strip():
        return value
    if isinstance(value, int) and not isinstance(value, bool) and value >= 1:
        return value
    raise ValueError(
        f": {value!r} names no column; give the header's name, or the column's number from 1 on"
    )


ColumnName = Annotated[str | int, PlainValidator(_checked)]
"""The header's text, or the number of the column, the first being 1."""


def column_label(name: str | int) -> str:
    """How messages call a column."""
    return f"column {name}" if isinstance(name, int) else name.strip().strip('"').strip()
