"""NAME.toml as an immutable model. Lengths in m, angles in rad, masses in kg, temperatures in C."""

from pathlib import Path
from typing import Literal

from pydantic import model_validator

from muscle_bayes.data.describing.columns import COLUMN_KEYS, Columns, column_kinds
from muscle_bayes.data.describing.elements import (
    ArmElement,
    Element,
    NoElement,
    SpringElement,
    Table,
)
from muscle_bayes.data.describing.log_format import LogFormat
from muscle_bayes.data.describing.tables import (
    Drive,
    Fixture,
    Heater,
    Load,
    Potentiometer,
    Thermometer,
    ThermometerLog,
)
from muscle_bayes.data.units import (
    COUNTS,
    DRIVES,
    POSITIONS,
    Kind,
    Unit,
    examples,
    unit_of,
)
from muscle_bayes.data.validation import parse_table, read_table

Protocol = Literal["spring", "staircase", "sawtooth", "free", "imposed"]
Origin = Literal["measured", "synthetic"]
Measured = Literal["position", "velocity", "force", "temperature"]


class Metadata(Table):
    """Everything NAME.toml says about a run.

    Raises pydantic's ValidationError where a table is wrong or tables contradict each other;
    `read_metadata` turns that into a RunError that names file and key.
    """

    format: Literal[1] = 1
    protocol: Protocol
    origin: Origin
    notes: str = ""
    fixture: Fixture = Fixture()
    potentiometer: Potentiometer | None = None
    thermometer: Thermometer | None = None
    thermometer_log: ThermometerLog | None = None
    log: LogFormat = LogFormat()
    columns: Columns | None = None
    element_a: Element
    element_b: Element = NoElement()
    load: Load | None = None
    drive: Drive | None = None
    heater_a: Heater | None = None
    heater_b: Heater | None = None

    @property
    def position_unit(self) -> str:
        """Unit of the log's position column, as the metadata write it."""
        if self.columns is None:
            return COUNTS
        if self.columns.position is None:
            return "m" if self.fixture.motion == "linear" else "rad"
        return self.columns.position_unit

    @property
    def output(self) -> Unit:
        """Unit of the measured output, with its factor to SI."""
        return self._unit(self.position_unit, "reading")

    @property
    def measured(self) -> Measured:
        """What the log's position column holds: the coordinate, or its rate."""
        return "velocity" if "velocity" in self.output.kind else "position"

    def kinds_of(self, column: str) -> tuple[tuple[Kind, ...], str]:
        """What a run's column may hold on this rig, and its unit where none is stated."""
        return column_kinds(column, self.fixture.motion, self.has_torque)

    def _unit(self, stated: str | None, column: str) -> Unit:
        kinds, usual = self.kinds_of(column)
        unit = unit_of(stated or usual, kinds)
        assert unit is not None, "Metadata guarantees units that fit"
        return unit

    @property
    def power_unit(self) -> Unit:
        """Unit of what heats, with its factor to SI."""
        return self._unit(getattr(self.columns, "power_unit", None), "power_a")

    def is_heated_by_power(self, side: str) -> bool:
        """Whether a side's temperature follows from its heater's power."""
        return self.columns is not None and getattr(self.columns, f"power_{side}") is not None

    @property
    def drive_unit(self) -> Unit:
        """Unit of the logged drive, with its factor to SI."""
        return self._unit(getattr(self.columns, "applied_unit", None), "applied")

    def is_reference_spring(self, side: str) -> bool:
        """Whether a side holds the thesis' own spring (eq. 12).

        Asked for by name, or a spring on pins of which nothing is stated in a log of the fixture's own
        format: that fixture has no other.
        """
        element = getattr(self, f"element_{side}")
        if not isinstance(element, SpringElement):
            return False
        stated = element.model_fields_set - {"kind", "linkage", "model"}
        own = self.columns is None and element.linkage == "pins" and not stated
        return element.model == "reference" or own

    @property
    def has_load(self) -> bool:
        """Whether a load table or a load column says what hangs on the rig."""
        return self.load is not None or (self.columns is not None and self.columns.load is not None)

    @model_validator(mode="after")
    def _tables_agree(self) -> "Metadata":
        self._check_position()
        self._check_columns()
        self._check_thermometer_log()
        self._check_load()
        self._check_drive()
        self._check_heaters()
        for side in ("a", "b"):
            self._check_element(side)
        return self

    def _check_position(self) -> None:
        text, motion = self.position_unit, self.fixture.motion
        kinds = POSITIONS[motion]
        if text == COUNTS and motion == "rotary" and self.potentiometer is None:
            raise ValueError(
                "potentiometer: missing, the position is in counts; add [potentiometer] with "
                "zero_reading and radians_per_count, or set columns.position_unit"
            )
        if unit_of(text, kinds) is None:
            raise ValueError(
                f"columns.position_unit: {text!r} does not fit fixture.motion = {motion!r}; "
                f"use one such as {examples(kinds)}, or change fixture.motion"
            )

    def _check_columns(self) -> None:
        columns, layout = self.columns, self.log
        if self.protocol == "imposed" and getattr(columns, "force", None) is None:
            raise ValueError(
                "columns.force: missing, protocol 'imposed' measures it; name its column"
            )
        if columns is None:
            if layout.sample_rate is not None or not layout.header:
                key = "log.header" if not layout.header else "log.sample_rate"
                raise ValueError(f"{key}: needs to know the columns; add [columns] with position")
            return
        self._check_force(columns)
        if columns.time is None and layout.sample_rate is None:
            raise ValueError(
                "columns.time: missing; name the time column, or give log.sample_rate in Hz "
                "where the log has none"
            )
        if not layout.header:
            for key in COLUMN_KEYS:
                if self.thermometer_log and key.startswith("temperature"):
                    continue
                if isinstance(name := getattr(columns, key), str):
                    raise ValueError(
                        f"columns.{key}: {name!r} is a name, and log.header = false says that the "
                        "log has none; give the column's number, the first being 1"
                    )
        if columns.applied_unit is not None:
            fits = DRIVES[self.fixture.motion]
            if unit_of(columns.applied_unit, fits) is None:
                raise ValueError(
                    f"columns.applied_unit: {columns.applied_unit!r} does not fit fixture.motion = "
                    f"{self.fixture.motion!r}; use one such as {examples(fits)}"
                )

    def _check_thermometer_log(self) -> None:
        columns = self.columns
        if self.thermometer_log is None:
            return
        if columns is None or (columns.temperature_a, columns.temperature_b) == (None, None):
            raise ValueError(
                "thermometer_log: given, but no column of it is named; name columns.temperature_a, or "
                "remove [thermometer_log]"
            )

    def _check_force(self, columns: Columns) -> None:
        if columns.position is None and self.protocol != "imposed":
            raise ValueError("columns.position: missing; name the column of the measured position")
        if columns.force is None:
            return
        if isinstance(self.element_a, NoElement):
            raise ValueError(
                "columns.force: is the tension of element_a, which is none; describe element_a"
            )
        fits, _ = self.kinds_of("force")
        if unit_of(self.force_unit, ("force", "torque")) != unit_of(self.force_unit, fits):
            raise ValueError(
                f"columns.force_unit: {self.force_unit!r} does not fit element_a; use one such as "
                f"{examples(fits)}"
            )

    @property
    def has_torque(self) -> bool:
        """Whether element_a has no length: what is measured of it is a torque."""
        return isinstance(self.element_a, ArmElement) or (
            isinstance(self.element_a, SpringElement) and self.element_a.linkage == "torsion"
        )

    @property
    def force_unit(self) -> str:
        """Unit of the measured force."""
        return getattr(self.columns, "force_unit", None) or self.kinds_of("force")[1]

    def _check_load(self) -> None:
        if self.load is not None and self.columns is not None and self.columns.load is not None:
            raise ValueError("columns.load: given together with [load]; keep the one that is right")
        if self.has_load and self.fixture.motion == "rotary" and self.fixture.disc_radius is None:
            raise ValueError(
                "fixture.disc_radius: missing, the rig is rotary and carries a load; "
                "add disc_radius in m to [fixture]"
            )

    def _check_heaters(self) -> None:
        for side in ("a", "b"):
            powered = self.is_heated_by_power(side)
            if getattr(self, f"heater_{side}") is not None and not powered:
                raise ValueError(
                    f"heater_{side}: given, but no column says what heats it; name "
                    f"columns.power_{side}, or remove [heater_{side}]"
                )
            if not powered:
                continue
            if getattr(self, f"element_{side}").kind != "muscle":
                raise ValueError(
                    f"columns.power_{side}: heats element_{side}, which is no muscle; remove it"
                )

    def _check_drive(self) -> None:
        if self.drive is None:
            return
        if self.columns is None or self.columns.applied is None:
            raise ValueError(
                "drive: given, but no column is driven by it; name columns.applied, or remove [drive]"
            )
        if self.drive.back_emf is not None and self.drive_unit.kind not in ("voltage", "duty"):
            raise ValueError(
                f"drive.back_emf: a drive logged in {self.drive_unit.text} has none; "
                "remove it, or correct columns.applied_unit"
            )

    def _check_element(self, side: str) -> None:
        element, motion = getattr(self, f"element_{side}"), self.fixture.motion
        if isinstance(element, NoElement):
            return
        if isinstance(element, ArmElement):
            if motion == "linear":
                raise ValueError(
                    f"element_{side}.kind: an arm swings, it does not fit fixture.motion = "
                    "'linear'; use rotary motion or another element"
                )
            return
        fits: tuple[str, ...] = ("straight",) if motion == "linear" else ("pins", "drum")
        if element.kind == "spring" and motion == "rotary":
            fits = (*fits, "torsion")
        if element.linkage not in fits:
            raise ValueError(
                f"element_{side}.linkage: {element.linkage!r} does not fit fixture.motion = "
                f"{motion!r}; use {' or '.join(map(repr, fits))}, or change fixture.motion"
            )
        if element.linkage == "pins":
            for key in (f"rotor_radius_{side}", f"anchor_x_{side}", f"anchor_y_{side}"):
                if getattr(self.fixture, key) is None:
                    raise ValueError(
                        f"fixture.{key}: missing, element_{side} is linked by pins; "
                        f"add {key} in m to [fixture]"
                    )


def read_metadata(path: Path) -> Metadata:
    """Read NAME.toml. Raises RunError, which names file, key and fix."""
    return read_table(path, Metadata)


def parse_metadata(content: bytes, path: Path | str) -> Metadata:
    """The metadata in the bytes of a TOML file; `path` serves the messages. Raises RunError."""
    return parse_table(content, path, Metadata)
