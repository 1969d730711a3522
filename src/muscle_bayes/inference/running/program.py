"""Compiled functions of arrays and of a problem's layout."""

import inspect
from collections.abc import Callable, Hashable
from functools import wraps
from threading import RLock
from typing import Any

import jax

STATIC = ("layout", "regime")
"""Names of arguments that are not arrays: each of their values has compiled code of its own."""


def program[R](function: Callable[..., R]) -> Callable[..., R]:
    """`jax.jit` of a function whose `layout` and `regime` are static, for use on several threads.

    The first call with arguments of new shapes holds a lock: else each thread would compile the same.
    """
    names = list(inspect.signature(function).parameters)
    static = [place for place, name in enumerate(names) if name in STATIC]
    compiled = jax.jit(function, static_argnums=static)
    known: set[Hashable] = set()
    making = RLock()

    def shapes_of(arguments: tuple[Any, ...]) -> Hashable:
        moving = [one for place, one in enumerate(arguments) if place not in static]
        leaves, structure = jax.tree.flatten(moving)
        shapes = tuple((getattr(x, "shape", ()), getattr(x, "dtype", type(x))) for x in leaves)
        return tuple(arguments[place] for place in static), structure, shapes

    @wraps(function)
    def call(*arguments: Any) -> R:
        shapes = shapes_of(arguments)
        if shapes in known:
            return compiled(*arguments)
        with making:
            result = compiled(*arguments)
            known.add(shapes)
        return result

    return call
