"""What a log's file cannot tell, the questions for it, and what is taken from the answers."""

import shlex
from dataclasses import dataclass
from typing import Final

import numpy as np

from muscle_bayes.data.checking.magnitudes import likely_temperature
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.guessing.guess import Guess
from muscle_bayes.data.guessing.roles import Column
from muscle_bayes.data.guessing.write import Entry
from muscle_bayes.data.repairing.clock import median_spacing
from muscle_bayes.data.units import ALL_POSITIONS, Kind, Unit, examples, unit_of

ELEMENTS: Final = "none, arm MASS DISTANCE, spring, muscle LENGTH [DRUM_RADIUS]"
"""What may be answered of what acts on the moving part; in kg and m."""


@dataclass
class Answers:
    """What the user has said; None where nothing."""

    time: str | None = None
    position: str | None = None
    position_unit: str | None = None
    time_unit: str | None = None
    temperature_unit: str | None = None
    sample_rate: float | None = None
    element: str | None = None
    load: float | None = None
    radians_per_count: float | None = None
    zero_reading: float | None = None


@dataclass(frozen=True)
class Question:
    """Something that the file cannot tell."""

    key: str
    """field of Answers, and with hyphens the command's option"""
    text: str
    default: str | None = None


def time_column(guess: Guess, answers: Answers) -> Column | None:
    """The time column, as answered or guessed. Raises RunError where the answer names none."""
    if answers.sample_rate is not None and answers.time is None:
        return None
    if answers.time is None:
        return None if guess.layout.sample_rate is not None and guess.time is None else guess.time
    return _named(guess, answers.time, "time")


def is_held(answers: Answers) -> bool:
    """Whether nothing moves: a force is measured."""
    return answers.position == "none"


def position_column(guess: Guess, answers: Answers) -> Column | None:
    """The measured column, as answered or guessed; None where several may be it."""
    if is_held(answers):
        return None
    if answers.position is not None:
        return _named(guess, answers.position, "position")
    time = time_column(guess, answers)
    candidates = [column for column in guess.measured if column is not time]
    positions = [column for column in candidates if column.likely == "position"]
    if len(positions) == 1:
        return positions[0]
    return candidates[0] if len(candidates) == 1 else None


def position_unit(column: Column | None, answers: Answers) -> Unit | None:
    """Unit of the measured column, as answered or said by the log; m where none is. Raises RunError."""
    if column is None:
        return unit_of("m", ALL_POSITIONS)
    if answers.position_unit is not None:
        return _unit_answered("position_unit", answers.position_unit, ALL_POSITIONS)
    return column.unit if column.unit is not None and column.unit.kind in ALL_POSITIONS else None


def _unit_answered(key: str, text: str | None, kinds: tuple[Kind, ...]) -> Unit | None:
    """The unit that an answer names; None where there is no answer. Raises RunError."""
    unit = None if text is None else unit_of(text, kinds)
    if text is not None and unit is None:
        raise RunError(
            f"--{key.replace('_', '-')} {text}: is no unit of {' or '.join(kinds)}. "
            f"Fix: give one such as {examples(kinds)}."
        )
    return unit


def next_question(guess: Guess, answers: Answers) -> Question | None:
    """The first thing that must be known and is not; None where all is known.

    Raises:
        RunError: an answer cannot be used.
    """
    time = time_column(guess, answers)
    if time is None and answers.sample_rate is None and guess.layout.sample_rate is None:
        return Question(
            "sample_rate",
            "No column rises as a time does. Rows per second, if they are evenly spaced",
        )
    position = position_column(guess, answers)
    if position is None and not is_held(answers):
        choices = ", ".join(_shown(column) for column in guess.columns if column is not time)
        held = "; none: held, a force is measured" if guess.likely("force") else ""
        return Question(
            "position", f"Column of the measured position or velocity ({choices}{held})"
        )
    unit = position_unit(position, answers)
    if unit is None:
        assert position is not None, "what is held is in metres"
        return Question(
            "position_unit",
            f"Unit of {_shown(position)} ({examples(ALL_POSITIONS)})",
        )
    if unit.kind == "counts":
        if not answers.radians_per_count:
            return Question(
                "radians_per_count", "Angle of one count, rad (negative: it counts down)"
            )
        if answers.zero_reading is None:
            return Question("zero_reading", "Counts at angle zero")
    _unit_answered("time_unit", answers.time_unit, ("time",))
    _unit_answered("temperature_unit", answers.temperature_unit, ("temperature",))
    if time is not None and answers.time_unit is None and (likely := _odd_time(time, position)):
        text = f"Unit of {_shown(time)}, whose rows lie {_usual_step(time):.4g} apart (s, ms, us)"
        return Question("time_unit", text, likely)
    for column in guess.likely("temperature_a", "temperature_b"):
        if (
            answers.temperature_unit is None
            and column.unit is None
            and (odd := likely_temperature(column.values))
        ):
            return Question(
                "temperature_unit", f"Unit of {_shown(column)} (degC, kelvin, degF)", odd
            )
    if answers.element is None:
        return Question("element", f"What acts on the moving part ({ELEMENTS})", "none")
    element_entries(answers.element, unit)
    kind = answers.element.split()[0]
    linear = unit.kind in ("length", "velocity")
    if answers.load and not linear:
        raise RunError(
            f"--load {answers.load:g}: a load on a rotary rig needs the radius at which it pulls. "
            "Fix: leave --load out, then add [load] and fixture.disc_radius to the metadata."
        )
    moved = linear and kind in ("spring", "muscle")
    told = guess.likely("load", "force")
    if answers.load is None and moved and not told and not is_held(answers):
        return Question("load", "Mass that hangs on it, kg", "0")
    return None


def element_entries(answer: str, unit: Unit) -> list[Entry]:
    """Keys of [element_a] from an answer such as `arm 0.49 0.10`. Raises RunError."""
    linear = unit.kind in ("length", "velocity")
    try:
        kind, *words = shlex.split(answer.replace(",", " "))
        sizes = [float(word) for word in words]
    except ValueError:
        kind, sizes = "", []
    if any(not np.isfinite(size) or size <= 0 for size in sizes):
        kind = ""
    if kind == "none" and not sizes:
        return [Entry("kind", "none", "nothing acts but friction: muscle | spring | arm | none")]
    if kind == "arm" and len(sizes) == 2 and not linear:
        return [
            Entry("kind", "arm"),
            Entry("mass", sizes[0], "kg"),
            Entry("centre_distance", sizes[1], "m from the axis to the centre of mass"),
            Entry("hanging_angle", 0.0, "rad, where it hangs at rest"),
        ]
    if kind == "spring" and not sizes:
        why = "rate, tension_at_zero and damping are estimated unless they are stated"
        return [
            Entry("kind", "spring", why),
            Entry("linkage", "straight" if linear else "torsion"),
        ]
    if kind == "muscle" and len(sizes) == (1 if linear else 2):
        drum = [] if linear else [Entry("drum_radius", sizes[1], "m")]
        return [
            Entry("kind", "muscle"),
            Entry("linkage", "straight" if linear else "drum"),
            *drum,
            Entry("base_length", sizes[0], "m, of the muscle without load"),
            Entry("length_at_zero", sizes[0], "m, where the position is zero: check"),
        ]
    fits = (
        "none, spring, or muscle LENGTH in m"
        if linear
        else "none, arm MASS DISTANCE in kg and m, spring, or muscle LENGTH DRUM_RADIUS in m"
    )
    raise RunError(f"--element {answer!r}: cannot be used on this rig. Fix: give {fits}.")


def _named(guess: Guess, wanted: str, role: str) -> Column:
    column = guess.column(wanted)
    if column is None:
        known = ", ".join(_shown(column) for column in guess.columns)
        raise RunError(f"--{role} {wanted}: there is no such column. Fix: give one of {known}.")
    return column


def _shown(column: Column) -> str:
    return repr(column.name) if column.name else f"column {column.number}"


def _odd_time(column: Column, position: Column | None) -> str:
    """The likely unit of a time column that says none and does not look like seconds.

    Steps of 5 and more are ms where they are whole, or where the rig swings: what is logged as
    slowly as that in s, drifts or goes in steps.
    """
    if column.unit is not None or column.clock != "number":
        return ""
    values = column.values[np.isfinite(column.values)]
    if not values.size:
        return ""
    if values[0] > 1e11:
        return "ms" if values[0] < 1e14 else "us"
    fast = bool(np.all(values == np.rint(values))) or (position is not None and _swings(position))
    return "ms" if _usual_step(column) >= 5.0 and fast else ""


def _usual_step(column: Column) -> float:
    return median_spacing(column.values[np.isfinite(column.values)])


def _swings(column: Column) -> bool:
    """Whether a motion passes its middle four times or more, each time by a tenth of its range."""
    values = column.values[np.isfinite(column.values)]
    if not values.size:
        return False
    away = values - np.mean(values)
    sides = np.sign(away[np.abs(away) > 0.1 * np.ptp(values)])
    return int(np.sum(np.diff(sides) != 0)) >= 4
