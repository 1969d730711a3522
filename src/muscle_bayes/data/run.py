"""One experiment: its table, its metadata, its sensor and what was repaired."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from html import escape
from math import inf
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd

from muscle_bayes.data.describing.columns import HEATER_COLUMNS
from muscle_bayes.data.describing.metadata import Measured, Metadata
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.repairing.clock import gaps
from muscle_bayes.data.repairing.ledger import Repair
from muscle_bayes.data.sensor import Sensor, force_sensor_of, grid_step, sensor_of
from muscle_bayes.errors import MuscleBayesError

COLUMNS = (
    "time",
    "reading",
    "temperature_a",
    "temperature_b",
    "setpoint_a",
    "setpoint_b",
    "load",
    "applied",
    "force",
    "power_a",
    "power_b",
    *HEATER_COLUMNS,
)
"""Columns of a run's table."""

MIN_ROWS = 10
"""Fewest rows of a run that is cut."""


@dataclass(frozen=True, eq=False, repr=False)
class Run:
    """A run as read.

    `table` holds float64 columns: time [s after the first row kept, rising], reading [in the log's
    own unit, as logged], temperature_a, temperature_b [C], setpoint_a, setpoint_b [C, NaN where
    the log has none], load [kg], applied [N m, N, A, V or duty, see
    metadata.drive_unit; 0 where none], force [as logged], power_a, power_b [W, A, V or duty],
    duty_a, duty_b [of 255], faults [bits] and fan [0 or 1], NaN where the log does not tell.
    """

    name: str
    """file stem"""
    path: Path | None
    """the log's file"""
    metadata: Metadata
    table: pd.DataFrame
    repairs: tuple[Repair, ...] = ()
    checksum: str = ""
    """sha256, hexadecimal, over the bytes of the log and of the metadata"""
    start: float = 0.0
    """the log's own time of the first row kept, s"""
    dropped_lead: float = 0.0
    """s between the log's first row and the first row kept"""
    clock: str = "number"
    """how the log gives time: number, hms, iso, pattern, or rate (no time column)"""
    imposed: np.ndarray | None = None
    """coordinate of each row, rad or m, where readings are of a force or a temperature and the motion is
    as logged"""
    heated: Literal["a", "b"] | None = None
    """the side whose temperature the readings are of; None: of a position, its rate, or a force"""
    own_times: Mapping[str, np.ndarray] = field(default_factory=dict)
    """column -> times of its own readings, s on the table's clock, of sensors slower than the rows;
    the table holds straight lines between them (of loads and applied forces the last value)"""

    @property
    def duration(self) -> float:
        """s between first and last row."""
        time = self.table["time"]
        return float(time.iloc[-1] - time.iloc[0])

    def until(self, time: float) -> "Run":
        """The run's rows before `time` [s after the first row]. Raises RunError if few are left."""
        table = self.table[self.table["time"] < time].reset_index(drop=True)
        if len(table) < MIN_ROWS:
            raise RunError(
                f"{self.name}: only {len(table)} rows lie before {time:g} s, "
                f"at least {MIN_ROWS} are needed. Fix: choose a later time."
            )
        own = {key: times[times < time] for key, times in self.own_times.items()}
        imposed = None if self.imposed is None else self.imposed[: len(table)]
        return replace(self, table=table, own_times=own, imposed=imposed)

    @property
    def unit(self) -> str:
        """Unit of the readings."""
        return self.output_sensor.unit

    @property
    def has_muscle(self) -> bool:
        """Whether a muscle moves the rig."""
        return "muscle" in (self.metadata.element_a.kind, self.metadata.element_b.kind)

    @property
    def has_force(self) -> bool:
        """Whether a force was measured."""
        return bool(self.table["force"].notna().all())

    def has_thermometer(self, side: str) -> bool:
        """Whether the log has a column of a side's temperature."""
        columns = self.metadata.columns
        return columns is None or getattr(columns, f"temperature_{side}") is not None

    def of_force(self) -> "Run":
        """The run whose readings are the measured force, its coordinate imposed as logged.

        Raises RunError where no force, or no position, was measured.
        """
        if not self.has_force or self.measured != "position":
            raise RunError.at(
                self.path or self.name,
                "needs a measured force and the position at which it was measured",
                "name columns.force, and a column of position",
                key="columns.force",
            )
        table = self.table.assign(reading=self.table["force"], force=np.nan)
        return replace(self, name=f"{self.name}-force", table=table, imposed=self.coordinate)

    def of_temperature(self, side: Literal["a", "b"]) -> "Run":
        """The run whose readings are a side's temperature beside its heater's power [C], dated back."""
        seen = np.interp(self.table["time"], self.heat_time, self.table[f"temperature_{side}"])
        name, table = f"{self.name}-temperature-{side}", self.table.assign(reading=seen)
        return replace(self, name=name, table=table, imposed=self.coordinate, heated=side)

    @cached_property
    def heat_time(self) -> np.ndarray:
        """When the rows' temperatures were measured, s on the table's clock, shape (rows,)."""
        meter = self.metadata.thermometer
        return self.table["time"].to_numpy() - (0.0 if meter is None else meter.delay or 0.0)

    @cached_property
    def output_sensor(self) -> Sensor:
        """Conversion between readings and what was measured."""
        readings = self.table["reading"].to_numpy()
        if self.heated is not None:
            return Sensor("degC", 0.0, 1.0, 1, grid_step(readings), 0.0)
        make = sensor_of if self.imposed is None else force_sensor_of
        return make(self.metadata, readings)

    @property
    def sensor(self) -> Sensor:
        """Conversion between readings and the rotor coordinate. Raises RunError of velocities."""
        if self.measured != "position":
            raise RunError.at(
                self.path or self.name,
                f"the log measures a {self.measured}, in {self.unit}, where a position is needed",
                "log the position, or integrate the velocity to one",
                key="columns.position_unit",
            )
        return self.output_sensor

    @property
    def measured(self) -> Measured:
        """What the readings are of."""
        if self.heated is not None:
            return "temperature"
        return self.metadata.measured if self.imposed is None else "force"

    @property
    def stops(self) -> tuple[float, float]:
        """Lower and upper endstop, rad or m; infinite where the metadata state none."""
        stops = self.metadata.fixture.stops
        return (-inf, inf) if stops is None else (stops[0], stops[1])

    @cached_property
    def output(self) -> np.ndarray:
        """What was measured, in SI: rad or m, or rad/s or m/s, shape (rows,)."""
        return self.output_sensor.coordinate(self.table["reading"].to_numpy())

    @cached_property
    def coordinate(self) -> np.ndarray:
        """Rotor coordinate of each row, rad or m, shape (rows,). Raises RunError of velocities."""
        if self.imposed is not None:
            return self.imposed
        return self.sensor.coordinate(self.table["reading"].to_numpy())

    @cached_property
    def load_steps(self) -> tuple[float, ...]:
        """Times within the run at which the load changes, s on the table's clock."""
        if (load := self.metadata.load) is not None:
            times = np.asarray(load.time) - self.dropped_lead
            changes = np.diff(load.mass, prepend=0.0) != 0
            within = (times > 0) & (times <= self.duration)
            return tuple(float(time) for time in times[changes & within])
        mass, time = self.table["load"].to_numpy(), self.table["time"].to_numpy()
        return tuple(float(at) for at in time[1:][np.diff(mass) != 0])

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Start and end of each long gap in the log, s."""
        return gaps(self.table["time"].to_numpy())

    def __repr__(self) -> str:
        return f"<Run {' | '.join(self._facts())}>"

    def _repr_html_(self) -> str:
        items = "".join(f"<li>{escape(str(repair))}</li>" for repair in self.repairs)
        facts = escape(" | ".join(self._facts()))
        repairs = f"<details><summary>repairs</summary><ul>{items}</ul></details>" if items else ""
        return f"<div><b>Run</b> {facts}{repairs}{self.table.head()._repr_html_()}</div>"  # type: ignore[operator]

    def _facts(self) -> list[str]:
        repairs = sum(repair.count for repair in self.repairs)
        return [
            self.name,
            self.metadata.protocol,
            self.metadata.origin.upper() if self.metadata.origin == "synthetic" else "measured",
            f"{len(self.table)} rows, {self.duration:.1f} s",
            f"{self.measured} in {self.unit}",
            f"{repairs} repairs" if repairs else "no repairs",
        ]


def refuse_unread(runs: Sequence[Run]) -> None:
    """Raise MuscleBayesError for anything but a list of runs that has one at least."""
    if isinstance(runs, Run):
        raise MuscleBayesError(f"runs must be a list, not {runs.name} alone. Fix: give [run].")
    listed = isinstance(runs, Sequence) and not isinstance(runs, str)
    if not listed or not all(isinstance(run, Run) for run in runs):
        raise MuscleBayesError(
            "runs must be read first. Fix: read them, as in mb.fit(mb.read_runs([...]))."
        )
    if not runs:
        raise MuscleBayesError("no runs were given. Fix: name at least one log or folder.")
