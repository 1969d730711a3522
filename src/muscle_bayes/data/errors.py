"""What went wrong with a run, said so that its owner can fix it."""

from pathlib import Path

from muscle_bayes.errors import MuscleBayesError


class RunError(MuscleBayesError):
    """A run that cannot be read or written: file, place, what was wrong and what to do."""

    @classmethod
    def at(
        cls,
        path: Path | str,
        problem: str,
        fix: str,
        *,
        row: int | None = None,
        column: str | None = None,
        key: str | None = None,
    ) -> "RunError":
        """Compose the message. `row` is the line of the file, the header being line 1."""
        place = [str(path)]
        if row is not None:
            place.append(f"row {row} (line of the file, the header is 1)")
        if column is not None:
            place.append(f"column {column!r}")
        if key is not None:
            place.append(f"key {key}")
        ending = "" if problem.endswith("?") else "."
        end = "" if fix.endswith("?") else "."
        return cls(f"{', '.join(place)}: {problem.rstrip('.')}{ending} Fix: {fix.rstrip('.')}{end}")
