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


def read_table[T: BaseModel](path: Path, model: type[T], what: str) -> T:
    """A TOML file as a model; `what` names it in messages. Raises RunError naming file, key and fix."""
    content = read_bytes(path, what)
    return parse_table(content, path, model)


def parse_table[T: BaseModel](content: bytes, path: Path | str, model: type[T]) -> T:
    """The bytes of a TOML file as a model; `path` serves the messages. Raises RunError."""
    with faults_told(path, model):
        return model.model_validate(parse_toml(content, path))


@contextmanager
def faults_told(path: Path | str, model: type[BaseModel], also: str = "") -> Iterator[None]:
    """Raise RunError for what pydantic finds wrong; `also` is added to the fix."""
    try:
        yield
    except ValidationError as error:
        key, problem, fix = explain(error, model)
        raise RunError.at(path, problem, fix + also, key=key) from None


def explain(error: ValidationError, model: type[BaseModel]) -> tuple[str, str, str]:
    """Key, problem and fix of the first fault, with the number of the others.

    Entries of arrays are counted from 1. A validator's own message reads "key: problem; fix".
    """
    # Unknown keys first: a misspelt key is also the reason for a missing one.
    found = sorted(error.errors(), key=lambda detail: detail["type"] != "extra_forbidden")
    key, problem, fix = _explain(found[0], model)
    if len(found) > 1:
        fix = f"{fix} ({len(found) - 1} more after this one)"
    return key, problem, fix


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
            return key, "missing", f"add {parts[-1]}"
        case "union_tag_not_found":
            return f"{key}.kind", "missing", f"add kind, one of {', '.join(_kinds(models))}"
        case "union_tag_invalid":
            return _choice(f"{key}.kind", detail["input"].get("kind"), _kinds(models))
        case "literal_error":
            choices = re.findall(r"'([^']*)'|(-?\d+)", detail["ctx"]["expected"])
            return _choice(key, detail["input"], [text or number for text, number in choices])
        case "value_error":
            inner, _, rest = detail["msg"].removeprefix("Value error, ").partition(": ")
            problem, _, fix = rest.rpartition("; ")
            return ".".join(filter(None, (key, inner))), problem, fix
    told = detail["msg"].lower().replace("tuple", "list")  # TOML has lists only
    given = repr(detail["input"])
    return key, f"{given if len(given) <= 60 else given[:60] + '...'}: {told}", "correct the value"


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
