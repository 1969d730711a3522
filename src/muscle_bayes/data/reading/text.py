"""Bytes of a log -> lines of text."""

import re
from pathlib import Path

from muscle_bayes.data.errors import RunError
from muscle_bayes.data.repairing.ledger import Repair

_OTHER_KINDS = {
    b"PK\x03\x04": "an Excel workbook or a zip archive",
    b"\xd0\xcf\x11\xe0": "an old Excel workbook",
    b"\x1f\x8b": "a gzip archive",
    b"PAR1": "a Parquet table",
    b"\x89HDF": "an HDF5 file",
    b"MATLAB 5.0": "MATLAB variables",
    b"%PDF": "a PDF document",
}
_NUL_SHARE = 0.3
"""Share of zero bytes in the first kilobyte above which text is taken for UTF-16 without a mark."""


def decode(content: bytes, path: Path, encoding: str | None) -> tuple[str, list[Repair]]:
    """Text of a log, and what had to be repaired to have it.

    Args:
        content: the file's bytes.
        path: serves the messages.
        encoding: as [log] states it; None = UTF-8 with or without a mark, else Latin-1.

    Raises:
        RunError: the bytes are not text of that encoding.
    """
    for mark, kind in _OTHER_KINDS.items():
        if content.startswith(mark):
            raise RunError.at(
                path,
                f"holds {kind}, no text",
                "save the log as CSV, or give it the name it should have",
            )
    if encoding is not None:
        try:
            return content.decode(encoding).removeprefix("\ufeff"), []
        except (UnicodeError, ValueError) as error:
            raise RunError.at(
                path,
                f"the log is not {encoding} text: {error}",
                "correct log.encoding in the metadata, or remove it",
                key="log.encoding",
            ) from None
    if content.startswith((b"\xff\xfe", b"\xfe\xff")) or _looks_utf16(content):
        raise RunError.at(
            path, "the log is UTF-16 text", 'save it as UTF-8, or add encoding = "utf-16" to [log]'
        )
    try:
        return content.decode("utf-8-sig"), []
    except UnicodeDecodeError as error:
        before = content[: error.start].replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        line = before.count(b"\n") + 1
        repair = Repair("encoding", 1, line, "not UTF-8: the whole file was read as Latin-1")
        return content.decode("latin-1"), [repair]


def split_lines(text: str) -> list[str]:
    """Lines of a text, whose ends may be LF, CR LF or CR in any mixture."""
    return re.sub("\r\n?", "\n", text).split("\n")


def _looks_utf16(content: bytes) -> bool:
    head = content[:1000]
    zeros = head.count(0)
    return zeros > _NUL_SHARE * len(head) and zeros < 0.7 * len(head) and len(head) > 20
