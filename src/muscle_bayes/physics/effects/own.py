"""Effects from outside this package: a user's files, and installed packages."""

import hashlib
import importlib.util
import inspect
import os
import sys
from collections.abc import Sequence
from functools import lru_cache
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.physics.effect import CourseFilter, Effect

FILES = "MUSCLE_BAYES_EFFECTS"
"""Environment variable that names files with effects, separated as in PATH: processes inherit it."""
GROUP = "muscle_bayes.effects"
"""Entry points of installed packages that are effects."""

AnyEffectType = type[Effect] | type[CourseFilter]


def own_effects() -> dict[str, AnyEffectType]:
    """Effects that are not of this package, by name. Raises MuscleBayesError where one cannot be had."""
    named = os.environ.get(FILES, "")
    found = _installed() | _GIVEN
    for path in filter(None, named.split(os.pathsep)):
        found |= _of_file(Path(path).resolve())
    return found


_GIVEN: dict[str, AnyEffectType] = {}


def effect_names(effects: Sequence[str | AnyEffectType]) -> tuple[str, ...]:
    """Names of effects; classes of your own are made known by theirs, as those of files are.

    Raises MuscleBayesError for a single name or class, and for what is no effect.
    """
    if isinstance(effects, str | type):
        shown = effects.__name__ if isinstance(effects, type) else repr(effects)
        raise MuscleBayesError(f"effects must be a list, not {shown}. Fix: give [{shown}].")
    return tuple(one if isinstance(one, str) else _given(one) for one in effects)


def _given(effect: AnyEffectType) -> str:
    whole = isinstance(effect, type) and issubclass(effect, (CourseFilter, Effect))
    if not (whole and all(hasattr(effect, key) for key in ("name", "port", "parameters"))):
        raise MuscleBayesError(
            f"{effect!r} is no effect. Fix: give names of the catalogue, or subclasses of "
            "muscle_bayes.physics.effect.Effect with name, port and parameters."
        )
    if effect.__module__.partition(".")[0] != __name__.partition(".")[0]:
        _GIVEN[effect.name] = effect
    return effect.name


def own_sources() -> dict[str, str]:
    """SHA-256 of the file that holds each such effect, by the effect's name."""
    return {
        name: hashlib.sha256(Path(inspect.getfile(one)).read_bytes()).hexdigest()
        for name, one in own_effects().items()
    }


@lru_cache
def _of_file(path: Path) -> dict[str, AnyEffectType]:
    module = _loaded(path)
    found = {
        one.name: one
        for one in vars(module).values()
        if isinstance(one, type)
        and issubclass(one, (CourseFilter, Effect))
        and one.__module__ == module.__name__
        and hasattr(one, "name")
    }
    if not found:
        raise MuscleBayesError(
            f"{FILES}: {path} holds no effect. Fix: write a subclass of "
            "muscle_bayes.physics.effect.Effect with a name, as docs/architecture.md shows."
        )
    return found


def _loaded(path: Path) -> ModuleType:
    # No name of this package: what is compiled with it must not be kept (inference.running.program).
    name = f"own_effects_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise MuscleBayesError(
            f"{FILES}: {path} is no Python file. Fix: name a file that ends in .py"
        )
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise MuscleBayesError(
            f"{FILES}: {path} cannot be imported: {type(error).__name__}: {error}. Fix: correct it, "
            f"or take it out of {FILES}."
        ) from error
    return module


@lru_cache
def _installed() -> dict[str, AnyEffectType]:
    return {one.name: one.load() for one in entry_points(group=GROUP)}
