"""Log and metadata -> NAME.csv and NAME.toml, the same bytes for the same input."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from muscle_bayes.data.describing.log_format import LogFormat
from muscle_bayes.data.describing.metadata import Metadata
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.log import HEADER


def write_run(folder: Path, name: str, log: pd.DataFrame, metadata: Metadata) -> Path:
    """Write folder/NAME.csv and folder/NAME.toml, and return the path of the CSV.

    `log` has exactly the columns of HEADER. Times are written to 1 ms, temperatures to 0.1 C (NaN
    setpoints blank), counts as whole numbers, flags as 0/1. Raises RunError.
    """
    folder = Path(folder)
    path = folder / f"{name}.csv"
    _check(log, metadata, path)
    columns = [_text(log[column].to_numpy(), column) for column in HEADER]
    rows = [", ".join(HEADER), *map(",".join, zip(*columns, strict=True))]
    folder.mkdir(parents=True, exist_ok=True)
    path.write_bytes(("\n".join(rows) + "\n").encode())
    path.with_suffix(".toml").write_bytes(to_toml(metadata).encode())
    return path


def to_toml(metadata: Metadata) -> str:
    """The metadata as TOML, keys in the order of the models."""
    content = metadata.model_dump(exclude_none=True)
    if metadata.columns is not None and not metadata.columns.accept_units:
        del content["columns"]["accept_units"]
    for key, usual in (("notes", ""), ("log", LogFormat())):
        if getattr(metadata, key) == usual:
            del content[key]
    for side in ("element_a", "element_b"):
        content[side] = {"kind": None} | content[side]  # kind goes first
    return toml_tables(content)


def toml_tables(table: Mapping[str, Any], path: tuple[str, ...] = ()) -> str:
    """Nested tables as TOML, numbers in full precision; `path` is where `table` stands itself."""
    scalars = {key: value for key, value in table.items() if not isinstance(value, Mapping)}
    text = ""
    if path and (scalars or not table):
        text = f"\n[{'.'.join(path)}]\n"
    text += toml_keys(scalars)
    for key, value in table.items():
        if isinstance(value, Mapping):
            bare = key.replace("-", "").replace("_", "").isalnum() and key.isascii()
            text += toml_tables(value, (*path, key if bare else json.dumps(key)))
    return text


def toml_keys(table: Mapping[str, Any]) -> str:
    """Lines `key = value`."""
    return "".join(f"{key} = {toml_value(value)}\n" for key, value in table.items())


def toml_value(value: Any) -> str:
    """A number, flag, text, array or inline table of them in TOML."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {toml_value(one)}' for key, one in value.items())} }}"
    if isinstance(value, tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, str):
        # JSON's escapes are TOML's, but for the delete character.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(float(value)) if isinstance(value, float) else str(value)


def _check(log: pd.DataFrame, metadata: Metadata, path: Path) -> None:
    if metadata.columns is not None:
        raise RunError.at(
            path, "logs are written with the bench's own header", "leave it out", key="columns"
        )
    if tuple(log.columns) != HEADER:
        names = ", ".join(map(repr, log.columns))
        wanted = ", ".join(map(repr, HEADER))
        raise RunError.at(path, f"columns are {names}", f"give exactly {wanted}")
    for column in HEADER:
        if column.startswith("Setpoint"):
            continue
        bad = ~np.isfinite(log[column].to_numpy(dtype=np.float64))
        if bad.any():
            row = int(np.flatnonzero(bad)[0]) + 2
            raise RunError.at(path, "not a finite number", "fill it", row=row, column=column)
    counts = np.rint(log[HEADER[8]].to_numpy(dtype=np.float64))
    if (wild := (counts < 0) | (counts > 1023)).any():
        row = int(np.flatnonzero(wild)[0])
        problem = f"{counts[row]:g} is no 10-bit count"
        raise RunError.at(path, problem, "clip to 0..1023", row=row + 2, column=HEADER[8])


def _text(values: np.ndarray, column: str) -> list[str]:
    numbers = values.astype(np.float64)
    if column == HEADER[0]:
        return [f"{number:.3f}" for number in numbers]
    if column.endswith("(C)"):
        return ["" if np.isnan(number) else f"{number + 0.0:.1f}" for number in numbers]
    return [str(int(number)) for number in np.rint(numbers)]
