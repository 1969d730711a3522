"""Rigs from a TOML file and from PARAM=VALUE, by the dotted names of the rig's dataclasses."""

import tomllib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from muscle_bayes.data.files import parse_toml, read_bytes
from muscle_bayes.errors import MuscleBayesError, did_you_mean
from muscle_bayes.twin.effects import make_effect
from muscle_bayes.twin.plant.rig import Rig


def parameter_names(node: Any, path: str = "") -> list[str]:
    """Dotted names of everything that can be set."""
    names = []
    for field in fields(node):
        value = getattr(node, field.name)
        if field.name == "effects":
            continue
        if is_dataclass(value):
            names += parameter_names(value, f"{path}{field.name}.")
        else:
            names.append(path + field.name)
    return names


def resolve(rig: Rig, name: str) -> str:
    """Full name of a parameter given by its full name or by the end of it that is its own alone."""
    known = parameter_names(rig)
    found = [full for full in known if full == name or full.endswith(f".{name}")]
    if len(found) == 1:
        return found[0]
    if found:
        raise MuscleBayesError(
            f"parameter {name!r} is ambiguous. Fix: choose one of {', '.join(found)}."
        )
    raise MuscleBayesError(
        f"unknown rig parameter {name!r}.{did_you_mean(name, known)} Fix: choose one of "
        f"{', '.join(known)}."
    )


def override(rig: Rig, values: Mapping[str, Any]) -> Rig:
    """Rig with other values, given by name: `truth.J`, `J`, `muscle_a.K_hyst`, ..."""
    for name, value in values.items():
        full = resolve(rig, name)
        try:
            rig = _set(rig, full.split("."), value)
        except ValidationError as error:
            problem = error.errors()[0]["msg"].removeprefix("Value error, ").lower()
            raise MuscleBayesError(
                f"{full}: {value!r}: {problem}. Fix: correct the value."
            ) from None
    return rig


def parse_setting(text: str) -> tuple[str, Any]:
    """Name and value from PARAM=VALUE; VALUE as in TOML, words need no quotes."""
    name, separator, value = text.partition("=")
    if not separator or not name.strip():
        raise MuscleBayesError(f"{text!r} is not PARAM=VALUE. Fix: write it as J=0.0013.")
    try:
        return name.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return name.strip(), value.strip()


def read_rig(path: Path, rig: Rig | None = None) -> Rig:
    """Rig from a TOML file: tables as the dataclasses nest, [effects.NAME] for hidden effects.

    What the file leaves out keeps its value in `rig`, the default rig if none is given.
    """
    content = parse_toml(read_bytes(path), path)
    effects = content.pop("effects", {})
    try:
        rig = override(rig or Rig(), _flat(content))
        made = tuple(make_effect(name, **values) for name, values in effects.items())
    except MuscleBayesError as error:
        raise MuscleBayesError(f"{path}: {error}") from None
    except (AttributeError, TypeError):
        raise MuscleBayesError(
            f"{path}: effects: write one table [effects.NAME] for each, numbers inside"
        ) from None
    return replace(rig, truth=replace(rig.truth, effects=(*rig.truth.effects, *made)))


def _flat(table: Mapping[str, Any], path: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{path}{key}.")
        else:
            flat[path + key] = value
    return flat


def _set(node: Any, path: list[str], value: Any) -> Any:
    if len(path) > 1:
        value = _set(getattr(node, path[0]), path[1:], value)
    return replace(node, **{path[0]: value})
