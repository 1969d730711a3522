"""Tables that are no text: Parquet through pandas, HDF5 through pandas or as plain arrays."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from muscle_bayes.data.errors import RunError
from muscle_bayes.data.reading.rows import Row


@contextmanager
def _faults_told(path: Path, kind: str, needs: str, package: str) -> Iterator[None]:
    """Raise RunError for whatever the library that reads a kind of file raises, or where it is missing."""
    try:
        yield
    except RunError:
        raise
    except ImportError:
        fix = f"install it (pip install {package}), or save the log as CSV"
        raise RunError.at(path, needs, fix) from None
    except Exception as error:  # each library has errors of its own, and need not be installed
        reason = " ".join(str(error).split())[:200]
        raise RunError.at(
            path, f"is no readable {kind} file: {reason}", "save it again, or as CSV"
        ) from None


def parquet_rows(content: bytes, path: Path) -> list[Row]:
    """Header and rows of a Parquet file. Raises RunError, also where pyarrow is missing."""
    needs = "Parquet files need pyarrow, which is not installed"
    with _faults_told(path, "Parquet", needs, "pyarrow"):
        return _rows(pd.read_parquet(io.BytesIO(content)), path)


def hdf5_rows(content: bytes, path: Path, group: str | None) -> list[Row]:
    """Header and rows of an HDF5 file.

    Tables that pandas wrote are read through pandas. Of other files, the one-dimensional arrays of
    one length in a group are the columns, by name.

    Args:
        content: the file's bytes.
        path: serves the messages.
        group: the group that holds the columns; None = the root, or its only group.

    Raises:
        RunError: also where a table needs PyTables, which is not installed.
    """
    import h5py

    needs = "the table was written by pandas, whose HDF5 files need PyTables"
    with _faults_told(path, "HDF5", needs, "tables"):
        with h5py.File(io.BytesIO(content), "r") as file:
            names = list(file)
            if group is not None and group not in file:
                raise RunError.at(
                    path,
                    f"there is no group {group!r}; there are {', '.join(names[:20]) or 'none'}",
                    "correct log.group",
                    key="log.group",
                )
            node = file if group is None else file[group]
            if group is None and len(names) == 1 and isinstance(file[names[0]], h5py.Group):
                node = file[names[0]]
            if "pandas_type" not in node.attrs:
                return _rows(_arrays(node, path), path)
            name = node.name
        return _rows(pd.read_hdf(path, key=name), path)


def _arrays(node: Any, path: Path) -> pd.DataFrame:
    """Columns of a group's arrays; a table of records gives its fields."""
    import h5py

    if isinstance(node, h5py.Dataset):
        if node.dtype.names:
            return pd.DataFrame({name: node[name] for name in node.dtype.names})
        values = np.atleast_2d(np.asarray(node))
        return pd.DataFrame({str(at + 1): column for at, column in enumerate(values.T)})
    arrays = {
        name: item
        for name, item in node.items()
        if isinstance(item, h5py.Dataset) and item.ndim == 1
    }
    lengths = {item.shape[0] for item in arrays.values()}
    if len(lengths) != 1:
        told = ", ".join(f"{name} {item.shape[0]}" for name, item in arrays.items())
        raise RunError.at(
            path,
            f"expected one-dimensional arrays of one length in {node.name}; found {told or 'none'}",
            "add group, the group that holds the columns, to [log]",
            key="log.group",
        )
    return pd.DataFrame({name: np.asarray(item) for name, item in arrays.items()})


def _rows(table: Any, path: Path) -> list[Row]:
    """Header and rows as text, which keeps every digit; an index of times is a column."""
    if not isinstance(table, pd.DataFrame):
        raise RunError.at(path, "holds no table of columns", "save a table of columns")
    if table.index.name is not None:
        table = table.reset_index()
    columns = [_texts(table.iloc[:, at]) for at in range(table.shape[1])]
    header = [str(name) for name in table.columns]
    return [(1, header), *((at, list(row)) for at, row in enumerate(zip(*columns, strict=True), 2))]


def _texts(column: "pd.Series[Any]") -> list[str]:
    if pd.api.types.is_datetime64_any_dtype(column):
        return ["" if pd.isna(moment) else moment.isoformat() for moment in column]
    if pd.api.types.is_timedelta64_dtype(column):
        column = column.dt.total_seconds()
    if pd.api.types.is_bool_dtype(column):
        column = column.astype(float)
    return ["" if value is None or value is pd.NA else str(value) for value in column.tolist()]
