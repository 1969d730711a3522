"""The rig's tables of a run's metadata: geometry, potentiometer, column names and load."""

from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from muscle_bayes.conventions import Motion, PositionUnit
from muscle_bayes.data.elements import Finite, NonNegative, Positive, Table
from muscle_bayes.data.mass import check_mass


def _as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


class Fixture(Table):
    """Geometry of the rig; the keys with _a and _b belong to the sides."""

    motion: Motion = "rotary"
    rotor_radius_a: Positive | None = None
    anchor_x_a: Finite | None = None
    anchor_y_a: Finite | None = None
    rotor_radius_b: Positive | None = None
    anchor_x_b: Finite | None = None
    anchor_y_b: Finite | None = None
    disc_radius: Positive | None = None
    """R_d, m: radius at which the load's cable pulls"""
    stops: Annotated[tuple[Finite, Finite], BeforeValidator(_as_tuple)] | None = None
    """lower and upper endstop, rad (m where motion is linear)"""
    room_temperature: Annotated[float, Field(gt=-50, lt=100)] = 25.0
    """degrees C"""

    @model_validator(mode="after")
    def _stops_are_ordered(self) -> "Fixture":
        if self.stops is not None and not self.stops[0] < self.stops[1]:
            raise ValueError(
                f"stops: {list(self.stops)} is not [lower, upper]; swap or correct them"
            )
        return self


class Potentiometer(Table):
    """theta = radians_per_count (reading - zero_reading)."""

    zero_reading: Finite
    """counts at theta = 0"""
    radians_per_count: Finite
    """rad, negative where the reading counts against theta"""
    zero_uncertainty: NonNegative | None = None
    """standard uncertainty of zero_reading, counts; absent = 2"""
    resolution: Annotated[float, Field(gt=0, le=1)] | None = None
    """step of the readings, counts, below 1 where conversions were averaged; absent = 1"""

    @model_validator(mode="after")
    def _scale_is_not_zero(self) -> "Potentiometer":
        if self.radians_per_count == 0:
            raise ValueError("radians_per_count: is zero; give the angle of one count in rad")
        return self


class Thermometer(Table):
    """What measures the temperature columns."""

    delay: Annotated[float, Field(ge=-10, le=10)] | None = None
    """s by which temperatures are logged later than the readings of the same instant; absent =
    unknown: fits take 0 and estimate it within delay_uncertainty"""
    delay_uncertainty: Annotated[float, Field(ge=0, le=10)] = 0.0
    """standard uncertainty of the delay, s; above 0, fits estimate what the delay is off by"""


class Columns(Table):
    """Names of a log's columns, where they are not the fixture's own."""

    time: str
    position: str
    position_unit: PositionUnit = "counts"
    position_sign: Literal[1, -1] = 1
    position_zero: Finite | None = None
    """reading at coordinate zero, in position_unit; absent = 0"""
    position_zero_uncertainty: NonNegative | None = None
    """standard uncertainty of that, in position_unit; absent = exact"""
    temperature_a: str | None = None
    temperature_b: str | None = None
    load: str | None = None
    """kg, instead of [load]"""
    applied: str | None = None
    """known torque, N m, or force, N, where motion is linear"""

    @model_validator(mode="after")
    def _position_is_described_once(self) -> "Columns":
        if self.time.strip() == self.position.strip():
            raise ValueError(
                f"position: names the same column as time, {self.time!r}; name the position's own"
            )
        if self.position_unit == "counts":
            for key, own in (
                ("position_zero", "zero_reading"),
                ("position_zero_uncertainty", "zero_uncertainty"),
            ):
                if getattr(self, key) is not None:
                    raise ValueError(
                        f"{key}: is for positions that are not in counts; use potentiometer.{own}"
                    )
        return self


Steps = Annotated[tuple[NonNegative, ...], BeforeValidator(_as_tuple)]


class Load(Table):
    """Piecewise constant load: mass[i] kg hangs from time[i] s after the first row on."""

    time: Steps
    mass: Steps

    @model_validator(mode="after")
    def _masses_are_kilograms(self) -> "Load":
        for mass in self.mass:
            try:
                check_mass(mass)
            except ValueError as error:
                raise ValueError(f"mass{error}") from None
        return self

    @model_validator(mode="after")
    def _steps_are_a_table(self) -> "Load":
        if not self.time:
            raise ValueError("time: is empty; give at least one time and mass, or remove [load]")
        if len(self.time) != len(self.mass):
            raise ValueError(
                f"mass: {len(self.mass)} masses for {len(self.time)} times; give one mass a time"
            )
        for earlier, later in pairwise(self.time):
            if later <= earlier:
                raise ValueError(
                    f"time: {later} does not come after {earlier}; put the steps in rising order"
                )
        return self
