"""SEQUENCE.toml as an immutable model: what is done to the bench, and what is said about it."""

import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    model_validator,
)

from muscle_bayes.bench.heat.temperature_control import FULL_DUTY
from muscle_bayes.data import Element, Fixture, Metadata, NoElement, Origin, Potentiometer
from muscle_bayes.data import Load as LoadTable
from muscle_bayes.data.describing.elements import Finite, NonNegative, Positive, Table, as_tuple
from muscle_bayes.data.describing.metadata import Protocol
from muscle_bayes.data.describing.sizes import Mass

HOTTEST = 105.0
"""Highest setpoint that is taken, C."""


Setpoint = Annotated[float, Field(ge=0, le=HOTTEST, allow_inf_nan=False)]


def _file_name(name: str) -> str:
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._+-]{0,99}", name):
        raise ValueError(
            f": {name!r} is no name for files; use at most 100 letters, digits, points, - and _"
        )
    return name


Name = Annotated[str, AfterValidator(_file_name)]


class Stage(Table):
    """Setpoints [C, absent = heater off], held until heated channels are stable or for a duration.

    Stable: within 1 C of the setpoint for more than 10 s; then `wait` more seconds pass. `load` [kg]
    is what hangs from here on: the operator is asked for it, and the stage's time begins at the key.
    """

    setpoint_a: Setpoint | None = None
    setpoint_b: Setpoint | None = None
    duration: Positive | None = None
    """s; absent = until stable"""
    wait: NonNegative = 1.0
    """s"""
    load: Mass | None = None
    """kg"""
    pour_time: NonNegative = 0.0
    """s that the load takes to be poured, evenly, from the key on; 0 = it hangs at the key"""
    fan: bool = False
    """whether the fan cools the tubes; a heated stage with it counts as warmer than it is"""
    logged: bool = True
    """false: before the first stage that is logged, nothing is written"""
    note: str = ""
    """shown to the operator"""

    @model_validator(mode="after")
    def _ends(self) -> "Stage":
        if self.duration is None and self.setpoint_a is None and self.setpoint_b is None:
            raise ValueError(
                "duration: missing, no heater is on and so nothing becomes stable; "
                "add duration in s, or a setpoint"
            )
        if self.duration is not None and self.pour_time > self.duration:
            raise ValueError(
                f"pour_time: {self.pour_time:g} s is longer than the stage; lengthen its duration"
            )
        return self


class Repeat(Table):
    """Stages that are passed through several times.

    With `until_within` [counts] the passes end early: when every stage's last reading lies within it
    of the same stage's in the pass before ("until the motion repeats").
    """

    repeat: Annotated[int, Field(ge=1, le=1000)]
    until_within: Positive | None = None
    """counts"""
    stages: Annotated[tuple[Stage, ...], BeforeValidator(as_tuple), Field(min_length=1)]


def _which(value: Any) -> str:
    repeats = (
        "repeat" in value or "stages" in value
        if isinstance(value, Mapping)
        else isinstance(value, Repeat)
    )
    return "Repeat" if repeats else "Stage"


Block = Annotated[
    Annotated[Stage, Tag("Stage")] | Annotated[Repeat, Tag("Repeat")], Discriminator(_which)
]
Blocks = Annotated[tuple[Block, ...], BeforeValidator(as_tuple)]


def _once_through(blocks: tuple[Stage | Repeat, ...]) -> Iterator[Stage]:
    for block in blocks:
        yield from block.stages if isinstance(block, Repeat) else (block,)


def _logs_any(blocks: tuple[Stage | Repeat, ...]) -> bool:
    return any(stage.logged for stage in _once_through(blocks))


class RunPlan(Table):
    """One run: its name, the load with which it begins, its stages."""

    name: Name
    load: Mass = 0.0
    """kg"""
    stage: Annotated[Blocks, Field(min_length=1)]

    @model_validator(mode="after")
    def _something_is_logged(self) -> "RunPlan":
        if not _logs_any(self.stage):
            raise ValueError("stage: no stage is logged; remove logged = false from one of them")
        return self

    def once_through(self) -> tuple[Stage, ...]:
        """Every stage once, repeats not unrolled."""
        return tuple(_once_through(self.stage))

    def heats(self, side: Literal["a", "b"]) -> bool:
        """Whether any stage has a setpoint for a side."""
        return any(getattr(stage, f"setpoint_{side}") is not None for stage in self.once_through())


class LoadCell(Table):
    """mass = kg_per_count (counts - zero), for an HX711 on the sensor board."""

    zero: Finite
    """counts with nothing on it"""
    kg_per_count: Finite

    def mass(self, counts: float) -> float:
        """kg for counts."""
        return self.kg_per_count * (counts - self.zero)


class Limits(Table):
    """What ends a run with the heaters off. The firmware's own limits hold besides."""

    max_temperature: Annotated[float, Field(gt=0, le=110)] = 110.0
    """C, for host and firmware; the firmware itself takes no more than 110 C"""
    max_duty: Annotated[int, Field(ge=0, le=FULL_DUTY)] = FULL_DUTY
    stage_timeout: Positive = 3600.0
    """s until a stage is stable"""
    reconnect_time: NonNegative = 30.0
    """s that a board or the meter may be away, heaters off, before the run ends"""
    operator_timeout: Positive = 900.0
    """s of waiting for a key with a heater on, after which the heaters go off"""


class Stop(Table):
    """What ends a run early and well."""

    duration: Positive | None = None
    """s after the first row"""
    rest_time: Positive | None = None
    """s in which no reading leaves a band of two counts"""
    angle: Annotated[tuple[Finite, Finite], BeforeValidator(as_tuple)] | None = None
    """rad, [lowest, highest] beyond which the run ends"""


class RigTables(BaseModel):
    """The rig's tables of a file that may hold others."""

    model_config = ConfigDict(frozen=True, strict=True)

    fixture: Fixture | None = None
    potentiometer: Potentiometer | None = None
    element_a: Element | None = None
    element_b: Element | None = None
    load_cell: LoadCell | None = None


class Sequence(RigTables, extra="forbid"):
    """SEQUENCE.toml. Either `stage` (one run) or `run` (several) says what is done.

    fixture, potentiometer, element_a and element_b are the tables of NAME.toml; they, and load_cell, may
    be left to a rig file of their own.
    """

    format: Literal[1] = 1
    name: Name | None = None
    """of the one run; absent = the file's stem"""
    protocol: Protocol = "free"
    notes: str = ""
    load: Mass = 0.0
    """kg, at the beginning of the one run"""
    initial_angle: Finite | None = None
    """rad, simulated bench only: the rotor is released there; absent = in equilibrium"""
    initial_hyst: NonNegative = 0.02
    """simulated bench only"""
    log_period: Annotated[float, Field(ge=0.005, le=10.0)] = 0.03
    """s between rows"""
    limits: Limits = Limits()
    stop: Stop = Stop()
    stage: Blocks = ()
    run: Annotated[tuple[RunPlan, ...], BeforeValidator(as_tuple)] = ()

    @model_validator(mode="after")
    def _says_what_is_done(self) -> "Sequence":
        if not self.stage and not self.run:
            raise ValueError("stage: missing; add one [[stage]] table or more")
        if self.stage and self.run:
            raise ValueError("stage: given together with [[run]]; move it into a [[run]]")
        names = [run.name for run in self.run]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"run: {name!r} is the name of two runs; rename one of them")
        if self.stage and not _logs_any(self.stage):
            raise ValueError("stage: no stage is logged; remove logged = false from one of them")
        hottest = max(
            (
                setpoint
                for run in self.runs("run")
                for stage in run.once_through()
                for setpoint in (stage.setpoint_a, stage.setpoint_b)
                if setpoint is not None
            ),
            default=0.0,
        )
        if hottest > self.limits.max_temperature - 5.0:
            raise ValueError(
                f"limits.max_temperature: {self.limits.max_temperature:g} C leaves a setpoint of "
                f"{hottest:g} C less than 5 C for overshoot; raise it or lower the setpoint"
            )
        return self

    def runs(self, stem: str) -> tuple[RunPlan, ...]:
        """The runs, `stem` naming a single one that has no name."""
        if self.run:
            return self.run
        return (RunPlan(name=self.name or stem, load=self.load, stage=self.stage),)

    def metadata(self, origin: Origin, rig: Mapping[str, Any], load: float, notes: str) -> Metadata:
        """Metadata of a run that begins with a load [kg]; `rig` fills tables that are absent here.

        Raises pydantic's ValidationError where something is missing or does not fit.
        """
        of_the_rig = {key: table for key, table in rig.items() if key in RIG_TABLES}
        tables: dict[str, Any] = {"element_b": NoElement(), **of_the_rig}
        for key in RIG_TABLES:
            if (own := getattr(self, key)) is not None:
                tables[key] = own
        return Metadata(
            protocol=self.protocol,
            origin=origin,
            notes=" ".join(filter(None, (self.notes, notes))),
            load=LoadTable(time=(0.0,), mass=(load,)),
            **tables,
        )


RIG_TABLES = ("fixture", "potentiometer", "element_a", "element_b")
"""Tables of NAME.toml that describe the rig and not the run."""
