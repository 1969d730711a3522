"""Errors that users can fix: shown as a message, never as a traceback."""

from collections.abc import Iterable
from difflib import get_close_matches


class MuscleBayesError(Exception):
    """What was wrong, where (file, row, column, key) and what to do, in one message."""


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """A question that begins with a space, naming the known name nearest to `name`; or nothing."""
    near = get_close_matches(name, list(known), n=1, cutoff=0.75)
    return f" Did you mean {near[0]!r}?" if near else ""


def refuse_all_but(kind: type, value: object, name: str, fix: str) -> None:
    """Raise MuscleBayesError unless an argument of that name is of its kind."""
    if not isinstance(value, kind):
        shown = repr(value) if isinstance(value, str | int | float) else type(value).__name__
        raise MuscleBayesError(f"{name} must be a {kind.__name__}, not {shown}. Fix: {fix}.")
