"""Kinds of log files: text, LabVIEW measurements, Parquet and HDF5."""

from pathlib import Path

from muscle_bayes.data.describing.metadata import Metadata
from muscle_bayes.data.log import RawLog, assemble, parse_log
from muscle_bayes.data.reading.frames import hdf5_rows, parquet_rows
from muscle_bayes.data.reading.lvm import is_lvm, lvm_body


def parse_any(content: bytes, path: Path, metadata: Metadata) -> RawLog:
    """Cells of a log of any kind that is read; its suffix, and for LabVIEW its first line, say which.

    Args:
        content: the file's bytes.
        path: serves the messages and says the kind.
        metadata: of the run.

    Raises:
        RunError: the file is not of its kind, or cannot be split into cells.
    """
    suffix, layout = path.suffix.lower(), metadata.log
    if suffix == ".parquet":
        rows = parquet_rows(content, path)
        return assemble(rows, [], path, metadata.columns, layout)
    if suffix in (".h5", ".hdf5"):
        rows = hdf5_rows(content, path, layout.group)
        return assemble(rows, [], path, metadata.columns, layout)
    if is_lvm(content):
        skipped, stated = lvm_body(content, path, layout)
        return parse_log(content, path, metadata.columns, layout.model_copy(
            update={"skip_lines": skipped, **stated}
        ))  # fmt: skip
    return parse_log(content, path, metadata.columns, layout)
