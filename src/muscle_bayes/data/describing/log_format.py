"""The [log] table: how the text of a log is to be read."""

import codecs
from typing import Annotated, Literal

from pydantic import Field, model_validator

from muscle_bayes.data.describing.elements import Positive, Table

SEPARATORS = {"tab": "\t", "space": " ", "semicolon": ";", "comma": ","}
"""Words that stand for a separator."""


class LogFormat(Table):
    """Layout of the log's file. Every key is optional; the defaults are those of a plain CSV."""

    separator: Annotated[str, Field(min_length=1)] | None = None
    """what stands between cells: one character, or tab, space; absent = a `sep=` line's, else a
    comma (a tab in .tsv and .lvm)"""
    decimal: Literal[".", ","] = "."
    """decimal sign"""
    thousands: Literal[",", ".", " ", "'"] | None = None
    """sign between thousands; absent = none"""
    skip_lines: Annotated[int, Field(ge=0, le=100_000)] = 0
    """lines before the header, or before the first row where there is no header"""
    comment: Annotated[str, Field(min_length=1, max_length=10)] = "#"
    """lines that begin with this are no rows"""
    encoding: str | None = None
    """of the text; absent = UTF-8, else Latin-1"""
    header: bool = True
    """whether a line names the columns; where false, [columns] gives numbers"""
    sample_rate: Positive | None = None
    """rows per second; then the time column is not read"""
    time_format: str | None = None
    """number, hms, iso, or a pattern such as "%d.%m.%Y %H:%M:%S"; absent = recognised"""
    group: str | None = None
    """the group of an HDF5 file that holds the columns; absent = its root, or its only group"""

    @property
    def cell_separator(self) -> str | None:
        """The separator itself, where one is stated."""
        return None if self.separator is None else SEPARATORS.get(self.separator, self.separator)

    @model_validator(mode="after")
    def _signs_differ(self) -> "LogFormat":
        separator = self.cell_separator
        if separator is not None and (len(separator) != 1 or separator in '"\n\r\0'):
            raise ValueError(
                f"separator: {self.separator!r} is not one character; "
                'give one such as ";", or "tab" or "space"'
            )
        if self.thousands is not None and self.thousands == self.decimal:
            raise ValueError(
                f"thousands: {self.thousands!r} is the decimal sign too; correct one of them"
            )
        if self.encoding is not None:
            try:
                known = codecs.lookup(self.encoding)
            except (LookupError, ValueError):
                known = None
            # Some codecs turn bytes into bytes; they hold no text.
            if known is None or not getattr(known, "_is_text_encoding", True):
                raise ValueError(
                    f"encoding: {self.encoding!r} is not known; "
                    "give one such as utf-8, utf-16, latin-1, cp1252"
                )
        if self.time_format is not None and not (
            self.time_format in ("number", "hms", "iso") or "%" in self.time_format
        ):
            raise ValueError(
                f"time_format: {self.time_format!r} is not known; "
                'give number, hms, iso, or a pattern such as "%d.%m.%Y %H:%M:%S"'
            )
        return self
