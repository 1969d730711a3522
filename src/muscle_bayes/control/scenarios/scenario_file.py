"""A user's own scenario from TOML."""

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from muscle_bayes.control.scenarios.scenario import Scenario, course_of
from muscle_bayes.data.describing.elements import Finite, NonNegative, Table, as_tuple
from muscle_bayes.data.validation import read_table

LONGEST = 3600.0
"""s"""


class _Points(Table):
    """Values at times; between them held, or straight."""

    time: Annotated[tuple[NonNegative, ...], BeforeValidator(as_tuple)]
    """s, rising, from 0"""
    between: Literal["held", "straight"] = "held"

    def values(self) -> tuple[float, ...]:
        raise NotImplementedError

    @model_validator(mode="after")
    def _is_a_table(self) -> "_Points":
        if not self.time or self.time[0] != 0.0:
            raise ValueError("time: does not begin at 0; give the value at time 0 first")
        if any(b <= a for a, b in pairwise(self.time)):
            raise ValueError("time: does not rise; put the times in rising order")
        if len(self.values()) != len(self.time):
            raise ValueError(
                f"time: {len(self.time)} times for {len(self.values())} values; "
                "give one value a time"
            )
        return self

    def at(self, time: np.ndarray) -> np.ndarray:
        """The values at `time` [s]."""
        known = np.asarray(self.values(), float)
        if self.between == "straight":
            return np.interp(time, self.time, known)
        return known[np.searchsorted(self.time, time, side="right") - 1]


class _Setpoint(_Points):
    angle: Annotated[tuple[Finite, ...], BeforeValidator(as_tuple)]
    """rad"""

    def values(self) -> tuple[float, ...]:
        return self.angle


class _Load(_Points):
    mass: Annotated[tuple[NonNegative, ...], BeforeValidator(as_tuple)]
    """kg"""

    def values(self) -> tuple[float, ...]:
        return self.mass


class ScenarioTable(Table):
    """SCENARIO.toml: length [s], setpoint, load, noise, and whether muscles come from training."""

    format: Literal[1] = 1
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")]
    about: str = ""
    length: Annotated[float, Field(gt=1.0, le=LONGEST)]
    noise: bool = True
    trained: bool = False
    setpoint: _Setpoint
    load: _Load | None = None

    @model_validator(mode="after")
    def _asks_for_something(self) -> "ScenarioTable":
        if not any(self.setpoint.angle):
            raise ValueError("setpoint.angle: is zero throughout; errors are told relative to it")
        return self


def read_scenario(path: Path, period: float) -> Scenario:
    """Read SCENARIO.toml for a control period [s]. Raises RunError."""
    table = read_table(path, ScenarioTable)
    time = np.arange(round(table.length / period)) * period
    load = 0.0 * time if table.load is None else table.load.at(time)
    course = course_of(table.setpoint.at(time), load, trained=table.trained, noise=table.noise)
    return Scenario(table.name, table.about or f"{table.name} ({path.name})", course)
