"""The rig's tables of a run's metadata: geometry, potentiometer, thermometer and load."""

from itertools import pairwise
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from muscle_bayes.conventions import Motion
from muscle_bayes.data.describing.columns import ColumnName
from muscle_bayes.data.describing.elements import Table, as_tuple
from muscle_bayes.data.describing.log_format import LogFormat
from muscle_bayes.data.describing.sizes import (
    Finite,
    NonNegative,
    Positive,
    Radius,
    RoomTemperature,
    check_mass,
)
from muscle_bayes.data.units import stated_unit


class Fixture(Table):
    """Geometry of the rig; the keys with _a and _b belong to the sides."""

    motion: Motion = "rotary"
    rotor_radius_a: Radius | None = None
    anchor_x_a: Finite | None = None
    anchor_y_a: Finite | None = None
    rotor_radius_b: Radius | None = None
    anchor_x_b: Finite | None = None
    anchor_y_b: Finite | None = None
    disc_radius: Radius | None = None
    """R_d, m: radius at which the load's cable pulls"""
    inertia: NonNegative | None = None
    """of the moving part beyond arms and load, kg m^2 (kg where motion is linear); absent = estimated"""
    stops: Annotated[tuple[Finite, Finite], BeforeValidator(as_tuple)] | None = None
    """lower and upper endstop, rad (m where motion is linear); absent = none"""
    room_temperature: RoomTemperature = 25.0
    """degrees C"""

    @model_validator(mode="after")
    def _stops_are_ordered(self) -> "Fixture":
        if self.stops is not None and not self.stops[0] < self.stops[1]:
            raise ValueError(
                f"stops: {list(self.stops)} is not [lower, upper]; swap or correct them"
            )
        return self


CONVERTER_BITS = 10
"""Bits of a converter whose metadata say none."""


class Potentiometer(Table):
    """theta = radians_per_count (reading - zero_reading)."""

    zero_reading: Finite
    """counts at theta = 0"""
    radians_per_count: Finite
    """rad, negative where the reading counts against theta"""
    zero_uncertainty: NonNegative | None = None
    """standard uncertainty of zero_reading, counts; absent = 2"""
    bits: Annotated[int, Field(ge=1, le=32)] | None = None
    """of the converter: readings are whole counts from 0 to 2^bits - 1; absent = 10"""
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
    estimated about 0, within delay_uncertainty, or 1 s where that is absent too"""
    delay_uncertainty: Annotated[float, Field(ge=0, le=10)] = 0.0
    """standard uncertainty of the delay, s; above 0, fits estimate what the delay is off by"""


class ThermometerLog(Table):
    """A log of the temperatures, where another instrument wrote it on a clock of its own.

    [columns] then names the temperatures' columns in that file.
    """

    file: str
    """name of the file, beside the log"""
    time: ColumnName | None = None
    """absent only where its own `log` gives a sample_rate"""
    time_unit: str | None = None
    """absent = s"""
    offset: Finite | None = None
    """s by which its clock is ahead of the log's; absent = found by aligning both, and estimated"""
    log: LogFormat | None = None
    """how that file is written, as [log]; absent = a plain CSV"""

    @model_validator(mode="after")
    def _has_a_time(self) -> "ThermometerLog":
        if self.time is None and (self.log is None or self.log.sample_rate is None):
            raise ValueError("time: missing; name the time column of that file")
        if self.time_unit is not None:
            stated_unit("time_unit", self.time_unit, ("time",))
        return self


class Heater(Table):
    """How a heater warms its muscle: dT/dt = heating_rate u - (T - room_temperature) / cooling_time.

    u: power in W, the square of a current in A or voltage in V, or a duty. A key that is absent is
    estimated. Of a heated body with a capacity C [J/K] that loses G [W/K]: heating_rate = 1 / C (R / C
    of a current, 1 / (R C) of a voltage), cooling_time = C / G.
    """

    heating_rate: Positive | None = None
    """K/s per W, A^2, V^2 or whole duty"""
    cooling_time: Positive | None = None
    """s"""


class Drive(Table):
    """How the logged drive u moves the rig: force = gain (u - offset) - back_emf speed.

    Without this table a logged torque or force acts as logged. A key that is absent is estimated.
    """

    gain: Finite | None = None
    """N m (N where motion is linear) per A, V, whole duty, or logged N m (N)"""
    offset: Finite | None = None
    """value of the drive's column at which nothing pulls, A, V, duty, N m or N"""
    back_emf: NonNegative | None = None
    """N m s (N s/m) that a motor on a voltage or duty loses per unit of speed"""


Steps = Annotated[tuple[NonNegative, ...], BeforeValidator(as_tuple)]


def _in_kilograms(value: Any) -> Any:
    """The table with its masses in kg, where it states another unit."""
    if not isinstance(value, dict) or not isinstance(value.get("unit"), str):
        return value
    unit = stated_unit("unit", value["unit"], ("mass",))
    masses = value.get("mass")
    if isinstance(masses, list | tuple) and all(isinstance(mass, int | float) for mass in masses):
        masses = [mass * unit.factor for mass in masses] if unit.factor != 1.0 else masses
    return value | {"unit": "kg", "mass": masses}


class Load(Table):
    """Piecewise constant load: mass[i] hangs from time[i] s after the first row on."""

    unit: str | None = None
    """of the masses; absent = kg. Read masses are in kg whatever it says."""
    time: Steps
    mass: Steps
    """kg"""

    @model_validator(mode="before")
    @classmethod
    def _convert(cls, value: Any) -> Any:
        return _in_kilograms(value)

    @model_validator(mode="after")
    def _masses_are_kilograms(self) -> "Load":
        for mass in self.mass if self.unit is None else ():
            try:
                check_mass(mass)
            except ValueError as error:
                raise ValueError(
                    f'mass{error}, or add unit = "g", or unit = "kg" if it is right'
                ) from None
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
