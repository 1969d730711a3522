"""Sequence -> SEQUENCE.toml, for people to read and change."""

from collections.abc import Mapping
from typing import Any

from muscle_bayes.bench.sequence import Repeat, RunPlan, Sequence, Stage
from muscle_bayes.data.writer import toml_keys, toml_value


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
    return "[\n" + "".join(f"  {_inline(block)},\n" for block in blocks) + "]"


def _inline(block: Stage | Repeat) -> str:
    table = {key: toml_value(value) for key, value in _said(block).items()}
    if isinstance(block, Repeat):  # an inline table may not span lines
        table["stages"] = f"[{', '.join(map(_inline, block.stages))}]"
    return f"{{ {', '.join(f'{key} = {value}' for key, value in table.items())} }}"


def _said(block: Stage | Repeat) -> Mapping[str, Any]:
    return block.model_dump(exclude_defaults=True)
