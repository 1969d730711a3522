"""NAME.toml -> Metadata, with errors that name file, key and mend."""

import re
import tomllib
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from muscle_bayes.data.elements import ArmElement, MuscleElement, NoElement, SpringElement, Table
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.files import read_bytes
from muscle_bayes.data.metadata import Metadata
from muscle_bayes.data.tables import Columns, Fixture, Load, Potentiometer

_ELEMENTS: dict[str, type[Table]] = {
    "muscle": MuscleElement,
    "spring": SpringElement,
    "arm": ArmElement,
    "none": NoElement,
}
_TABLES: dict[str, type[Table]] = {
    "fixture": Fixture,
    "potentiometer": Potentiometer,
    "columns": Columns,
    "load": Load,
}


def read_metadata(path: Path) -> Metadata:
    """Read NAME.toml. Raises RunError."""
    return parse_metadata(read_bytes(path, "the run's metadata"), path)


def parse_metadata(content: bytes, path: Path | str) -> Metadata:
    """The metadata in the bytes of a TOML file; `path` serves the messages. Raises RunError."""
    try:
        tables = tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise RunError.at(
            path, f"line {line} is not UTF-8 text", "save the file as UTF-8"
        ) from None
    except tomllib.TOMLDecodeError as error:
        raise RunError.at(
            path, f"not valid TOML: {error}", "correct that line; text needs quotes"
        ) from None
    try:
        return Metadata.model_validate(tables)
    except ValidationError as error:
        # Unknown keys first: a misspelt key is also the reason for a missing one.
        found = sorted(error.errors(), key=lambda detail: detail["type"] != "extra_forbidden")
        raise _as_run_error(path, found[0], len(found) - 1) from None


def _as_run_error(path: Path | str, detail: ErrorDetails, others: int) -> RunError:
    location = [str(part) for part in detail["loc"]]
    if len(location) > 1 and location[1] in _ELEMENTS:
        kind = location.pop(1)
        model = _ELEMENTS[kind]
    else:
        model = _TABLES.get(location[0], Metadata) if len(location) > 1 else Metadata
    key, problem, mend = _explain(detail, location, model)
    if others:
        mend = f"{mend} ({others} more after this one)"
    return RunError.at(path, problem, mend, key=key)


def _explain(detail: ErrorDetails, location: list[str], model: type[Table]) -> tuple[str, str, str]:
    """Key, problem and mend of one validation error."""
    key = ".".join(location)
    match detail["type"]:
        case "extra_forbidden":
            known = list(model.model_fields)
            close = get_close_matches(location[-1], known, n=1)
            hint = f"did you mean {close[0]!r}?" if close else f"known are {', '.join(known)}"
            return key, "unknown key", f"remove it or correct its name; {hint}"
        case "missing":
            return key, "missing", f"add {location[-1]}"
        case "union_tag_not_found":
            return f"{key}.kind", "missing", f"add kind, one of {', '.join(_ELEMENTS)}"
        case "union_tag_invalid":
            return _choice(f"{key}.kind", detail["input"].get("kind"), list(_ELEMENTS))
        case "literal_error":
            choices = re.findall(r"'([^']*)'|(-?\d+)", detail["ctx"]["expected"])
            return _choice(key, detail["input"], [text or number for text, number in choices])
        case "value_error":
            inner, _, rest = detail["msg"].removeprefix("Value error, ").partition(": ")
            problem, _, mend = rest.rpartition("; ")
            return ".".join(filter(None, (key, inner))), problem, mend
    given = detail["input"]
    return key, f"{given!r}: {detail['msg'].lower()}", "correct the value"


def _choice(key: str, given: Any, choices: list[str]) -> tuple[str, str, str]:
    close = get_close_matches(str(given), choices, n=1)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    return key, f"{given!r} is not known", f"use one of {', '.join(choices)}{hint}"
