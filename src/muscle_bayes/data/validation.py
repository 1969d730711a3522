"""TOML files as models of their tables; what pydantic finds wrong -> file, key, problem and fix."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from muscle_bayes.data.errors import RunError
from muscle_bayes.data.files import parse_toml, read_bytes


def read_table[T: BaseModel](path: Path, model: type[T], fix: str = "correct the path") -> T:
    """A TOML file as a model; `fix` says what to do where there is none.

    Raises RunError naming file, key and fix.
    """
    content = read_bytes(path, fix)
    return parse_table(content, path, model)


def parse_table[T: BaseModel](content: bytes, path: Path | str, model: type[T]) -> T:
    """The bytes of a TOML file as a model; `path` serves the messages. Raises RunError."""
    with faults_told(path, model):
        return model.model_validate(parse_toml(content, path))


@contextmanager
def faults_told(path: Path | str, model: type[BaseModel], also: str = "") -> Iterator[None]:
    """Raise RunError for all that pydantic finds wrong, one a line; `also` is added to each fix."""
    try:
        yield
    except ValidationError as error:
        told = [
            str(RunError.at(path, problem, fix + also, key=key))
            for key, problem, fix in explain(error, model)
        ]
        raise RunError("\n".join(told)) from None


def explain(error: ValidationError, model: type[BaseModel]) -> list[tuple[str, str, str]]:
    """Key, problem and fix of every fault.

    Entries of arrays are counted from 1. A validator's own message reads "key: problem; fix".
    """
    # Unknown keys first: a misspelt key is also the reason for a missing one.
    found = sorted(error.errors(), key=lambda detail: detail["type"] != "extra_forbidden")
    return [_explain(detail, model) for detail in found]


def _explain(detail: ErrorDetails, model: type[BaseModel]) -> tuple[str, str, str]:
    parts, models = _walk(detail["loc"], model)
    key = ".".join(parts)
    match detail["type"]:
        case "extra_forbidden":
            known = [name for found in models for name in found.model_fields]
            close = get_close_matches(parts[-1], known, n=1)
            hint = f"did you mean {close[0]!r}?" if close else f"known are {', '.join(known)}"
            return key, "unknown key", f"remove it or correct its name; {hint}"
        case "missing":
            return key, "missing", f"add {_absent(parts[-1], key, models)}"
        case "union_tag_not_found":
            return f"{key}.kind", "missing", f"add kind, one of {', '.join(_kinds(models))}"
        case "union_tag_invalid":
            return _choice(f"{key}.kind", detail["input"].get("kind"), _kinds(models))
        case "literal_error":
            choices = re.findall(r"'([^']*)'|(-?\d+)", detail["ctx"]["expected"])
            if len(choices) == 1:
                ((text, number),) = choices
                only = f'"{text}"' if text else number
                return key, f"{detail['input']!r} is not known", f"write {parts[-1]} = {only}"
            return _choice(key, detail["input"], [text or number for text, number in choices])
        case "value_error":
            inner, _, rest = detail["msg"].removeprefix("Value error, ").partition(": ")
            problem, _, fix = rest.rpartition("; ")
            return ".".join(filter(None, (key, inner))), problem, fix
    told = detail["msg"].lower().replace("tuple", "list")  # TOML has lists only
    given = repr(detail["input"])
    return key, f"{given if len(given) <= 60 else given[:60] + '...'}: {told}", "correct the value"


def _absent(name: str, key: str, models: list[type[BaseModel]]) -> str:
    """How to write a key that is missing: its values, or its table's kinds, where there are few."""
    fields = [model.model_fields[name] for model in models if name in model.model_fields]
    if not fields and (kinds := _kinds(models)):
        return f"the table [{key}] with kind = {_either(kinds)}"
    values = get_args(fields[0].annotation) if fields else ()
    if values and all(isinstance(value, str) for value in values):
        first, *others = (f'"{value}"' for value in values)
        return f"{name} = {first} (or {', '.join(others)})"
    return name


def _either(kinds: list[str]) -> str:
    *others, last = (f'"{kind}"' for kind in kinds)
    return f"{', '.join(others)} or {last}"


def _choice(key: str, given: Any, choices: list[str]) -> tuple[str, str, str]:
    close = get_close_matches(str(given), choices, n=1)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    return key, f"{given!r} is not known", f"use one of {', '.join(choices)}{hint}"


def _walk(
    location: tuple[int | str, ...], model: type[BaseModel]
) -> tuple[list[str], list[type[BaseModel]]]:
    """Parts of a key without the tags of unions, and the models that stand at its last table."""
    parts: list[str] = []
    inside, here = [model], [model]
    for part in location:
        if isinstance(part, int):
            parts[-1] += f"[{part + 1}]"
        elif tagged := [found for found in here if part in (found.__name__, _kind(found))]:
            here = tagged
        else:
            inside = here
            fields = [found.model_fields[part] for found in here if part in found.model_fields]
            here = [found for field in fields for found in _models(field.annotation)]
            parts.append(part)
    return parts, here or inside


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    """Every model within an annotation."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from _models(argument)


def _kind(model: type[BaseModel]) -> Any:
    field = model.model_fields.get("kind")
    return None if field is None else field.default


def _kinds(models: list[type[BaseModel]]) -> list[str]:
    return [str(kind) for model in models if (kind := _kind(model)) is not None]
