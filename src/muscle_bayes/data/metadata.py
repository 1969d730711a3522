"""NAME.toml as an immutable model. Lengths in m, angles in rad, masses in kg, temperatures in C."""

from typing import Literal

from pydantic import model_validator

from muscle_bayes.conventions import PositionUnit
from muscle_bayes.data.elements import ArmElement, Element, NoElement, Table
from muscle_bayes.data.tables import Columns, Fixture, Load, Potentiometer, Thermometer

Protocol = Literal["spring", "staircase", "sawtooth", "free"]
Origin = Literal["synthetic", "measured"]


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
    columns: Columns | None = None
    element_a: Element
    element_b: Element = NoElement()
    load: Load | None = None

    @property
    def position_unit(self) -> PositionUnit:
        """Unit of the log's position column."""
        return "counts" if self.columns is None else self.columns.position_unit

    @property
    def has_load(self) -> bool:
        """Whether a load table or a load column says what hangs on the rig."""
        return self.load is not None or (self.columns is not None and self.columns.load is not None)

    @model_validator(mode="after")
    def _tables_agree(self) -> "Metadata":
        self._check_position()
        self._check_load()
        for side in ("a", "b"):
            self._check_element(side)
        return self

    def _check_position(self) -> None:
        unit, motion = self.position_unit, self.fixture.motion
        if unit == "counts" and self.potentiometer is None:
            raise ValueError(
                "potentiometer: missing, the position is in counts; add [potentiometer] with "
                "zero_reading and radians_per_count, or set columns.position_unit"
            )
        fits = ("m", "mm") if motion == "linear" else ("counts", "rad", "deg")
        if unit not in fits:
            raise ValueError(
                f"columns.position_unit: {unit!r} does not fit fixture.motion = {motion!r}; "
                f"use one of {', '.join(fits)}, or change fixture.motion"
            )

    def _check_load(self) -> None:
        if self.load is not None and self.columns is not None and self.columns.load is not None:
            raise ValueError("columns.load: given together with [load]; keep the one that is right")
        if self.has_load and self.fixture.motion == "rotary" and self.fixture.disc_radius is None:
            raise ValueError(
                "fixture.disc_radius: missing, the rig is rotary and carries a load; "
                "add disc_radius in m to [fixture]"
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
        fits = ("straight",) if motion == "linear" else ("pins", "drum")
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
