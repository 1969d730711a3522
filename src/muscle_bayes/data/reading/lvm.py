"""LabVIEW measurement files (.lvm): a header of their own, then columns."""

from pathlib import Path
from typing import Final

from muscle_bayes.data.describing.log_format import SEPARATORS, LogFormat
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.reading.text import decode, split_lines

_FIRST: Final = b"LabVIEW Measurement"
_END: Final = "***End_of_Header***"


def is_lvm(content: bytes) -> bool:
    """Whether a file begins as LabVIEW's measurement files do."""
    return content.removeprefix(b"\xef\xbb\xbf").startswith(_FIRST)


def lvm_body(content: bytes, path: Path, layout: LogFormat) -> tuple[int, dict[str, str]]:
    """Lines above the names of the columns, and what the file's header says of its layout.

    Args:
        content: the file's bytes.
        path: serves the messages.
        layout: as in the metadata; what it states goes before what the file says.

    Raises:
        RunError: the header has no end, or the file holds several blocks of columns.
    """
    text, _ = decode(content, path, layout.encoding)
    lines = split_lines(text)
    ends = [at for at, line in enumerate(lines, 1) if line.strip().startswith(_END)]
    if not ends:
        raise RunError.at(
            path, f"the LabVIEW header has no {_END}", "export the file again", row=len(lines)
        )
    # The first end closes the file's header, the second that of the first block of columns.
    body = ends[1] if len(ends) > 1 else ends[0]
    if len(ends) > 2:
        raise RunError.at(
            path,
            f"the file holds {len(ends) - 1} blocks of columns, each with a header",
            "export it with one header, or make a log of each block",
            row=ends[2],
        )
    said: dict[str, str] = {}
    for line in lines[: ends[0]]:
        name, _, value = line.partition("\t" if "\t" in line else ",")
        said[name.strip().lower()] = value.strip()
    stated: dict[str, str] = {}
    separator = said.get("separator", "tab").lower()
    if layout.separator is None and separator in SEPARATORS:
        stated["separator"] = separator
    if "decimal" not in layout.model_fields_set and said.get("decimal_separator") in (".", ","):
        stated["decimal"] = said["decimal_separator"]
    return max(body, layout.skip_lines), stated
