"""Double precision for our own computations, without changing the caller's settings."""

import functools
from collections.abc import Callable

import jax


def double_precision[**P, R](function: Callable[P, R]) -> Callable[P, R]:
    """Run `function` with 64-bit floats: dry friction and stiff springs need them."""

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        with jax.enable_x64(True):
            return function(*args, **kwargs)

    return wrapped
