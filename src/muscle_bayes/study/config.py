"""STUDY.toml: what somebody wants of the study of their own runs."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from muscle_bayes.conventions import Friction
from muscle_bayes.data.describing.elements import Finite, Table, as_tuple
from muscle_bayes.data.validation import read_table

Names = Annotated[tuple[str, ...], BeforeValidator(as_tuple)]
Range = Annotated[
    tuple[Finite, ...],
    BeforeValidator(lambda value: as_tuple(_listed(value))),
    Field(min_length=1),
]


def _listed(value: object) -> object:
    """A single number stands for a range without width."""
    return [value] if isinstance(value, (int, float)) and not isinstance(value, bool) else value


class Published(Table):
    """Values that somebody printed, to stand beside our posteriors.

    `of` says which fit they belong to: the fixture's with dry or with linear friction, or the muscle's.
    Each value is a number or a list of two, the ends of a range.
    """

    name: str
    """as the report's captions have it"""
    source: str
    of: Literal["coulomb", "linear", "muscle"]
    values: dict[str, Range]

    @model_validator(mode="after")
    def _ranges_have_two_ends(self) -> "Published":
        for name, ends in self.values.items():
            if len(ends) > 2 or ends[0] > ends[-1]:
                raise ValueError(
                    f"values.{name}: {list(ends)} is neither a number nor a range; give a number, or "
                    "the lower and the upper end"
                )
        return self


class StudyConfig(Table):
    """Everything STUDY.toml may say. What it leaves out follows from protocols and rigs (`roles.py`)."""

    format: Literal[1] = 1
    title: str = ""
    about: str = ""
    """what a reader has to know of the runs"""
    fixture: Names | None = None
    """runs that tell J and D"""
    muscle: Names | None = None
    """runs that tell the muscle"""
    held_out: Names | None = None
    """runs that are predicted only"""
    until: dict[str, Finite] = Field(default_factory=dict)
    """of a run, only rows before this time are fitted, and the rest is predicted [s]"""
    friction: Friction = "coulomb"
    effects: Names = ()
    """of the catalogue, in the model from the beginning"""
    candidates: Names | None = None
    """effects that discovery may add; all that the runs could show unless said"""
    control: bool | None = None
    """whether gains of an antagonistic joint are tuned; wherever a muscle turns a rotor unless said"""
    joint: str | None = None
    """TOML of the joint, beside this file; the muscle's own rig with its mirror image unless said"""
    evidence: Names = ()
    """folders, beside this file, with results of slow checks of the method"""
    seed: Annotated[int, Field(ge=0)] = 0
    thesis: bool = False
    """whether the runs are of the thesis' rig, so that its tables stand beside our posteriors"""
    published: Annotated[tuple[Published, ...], BeforeValidator(as_tuple)] = ()


def read_config(path: Path) -> StudyConfig:
    """Read STUDY.toml. Raises RunError naming file, key and fix."""
    return read_table(path, StudyConfig)
