"""SEQUENCE.toml to a sequence, with errors that name file and key, and back."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from muscle_bayes.bench.sequences.sequence import (
    RIG_TABLES,
    Repeat,
    RigTables,
    RunPlan,
    Sequence,
    Stage,
)
from muscle_bayes.data import Metadata, Origin, RunError
from muscle_bayes.data.validation import faults_told, parse_table, read_table
from muscle_bayes.data.writer import toml_keys, toml_value


def read_sequence(path: Path) -> Sequence:
    """Read SEQUENCE.toml. Raises RunError."""
    fix = f"write it with `muscle-bayes sequence staircase --out {path.name}`"
    return read_table(path, Sequence, fix)


def parse_sequence(content: bytes, path: Path | str) -> Sequence:
    """The sequence in the bytes of a TOML file; `path` serves the messages. Raises RunError."""
    return parse_table(content, path, Sequence)


def read_rig(path: Path) -> dict[str, Any]:
    """The rig's tables of a TOML file, which may be any run's NAME.toml. Raises RunError."""
    rig = read_table(path, RigTables)
    tables = {key: table for key, table in rig if table is not None}
    if not tables:
        raise RunError.at(path, "no table of a rig", f"add {', '.join(RIG_TABLES)}")
    return tables


def run_metadata(
    sequence: Sequence,
    path: Path | str,
    origin: Origin,
    rig: Mapping[str, Any],
    load: float,
    notes: str = "",
) -> Metadata:
    """`Sequence.metadata` with an error that names the file. Raises RunError."""
    with faults_told(path, Metadata, "; or give --rig FILE; --simulate needs none"):
        return sequence.metadata(origin, rig, load, notes)


def to_toml(sequence: Sequence, head: str = "") -> str:
    """The sequence as TOML; what is as in the defaults is left out, `head` goes first as comment."""
    content = sequence.model_dump(exclude_defaults=True, exclude={"stage", "run"})
    scalars = {key: value for key, value in content.items() if not isinstance(value, dict)}
    parts = [_comment(head), toml_keys({"format": 1, **scalars})]
    for key, value in content.items():
        if isinstance(value, dict):
            parts.append(f"\n[{key}]\n{toml_keys(_with_kind(getattr(sequence, key), value))}")
    parts += [f"\n[[stage]]\n{_block(block)}" for block in sequence.stage]
    parts += [f"\n[[run]]\n{_run(run)}" for run in sequence.run]
    return "".join(parts)


def _comment(text: str) -> str:
    return "".join(f"# {line}".rstrip() + "\n" for line in text.splitlines())


def _with_kind(model: Any, table: dict[str, Any]) -> dict[str, Any]:
    kind = getattr(model, "kind", None)
    return table if kind is None else {"kind": kind, **table}


def _block(block: Stage | Repeat) -> str:
    table = dict(_said(block))
    if isinstance(block, Stage):
        return toml_keys(table)
    del table["stages"]
    return toml_keys(table) + f"stages = {_array(block.stages)}\n"


def _run(run: RunPlan) -> str:
    return toml_keys({"name": run.name, "load": run.load}) + f"stage = {_array(run.stage)}\n"


def _array(blocks: tuple[Stage | Repeat, ...]) -> str:
    return "[\n" + "".join(f"  {toml_value(_said(block))},\n" for block in blocks) + "]"


def _said(block: Stage | Repeat) -> Mapping[str, Any]:
    return block.model_dump(exclude_defaults=True)
