"""Runs: reading, repairing, writing."""

from muscle_bayes.data.describing.assumptions import Assumption, assumptions
from muscle_bayes.data.describing.columns import HEATER_HEADER, Columns
from muscle_bayes.data.describing.elements import (
    ArmElement,
    Element,
    MuscleElement,
    NoElement,
    SpringElement,
)
from muscle_bayes.data.describing.log_format import LogFormat
from muscle_bayes.data.describing.metadata import Metadata, Origin, Protocol, read_metadata
from muscle_bayes.data.describing.tables import (
    Drive,
    Fixture,
    Heater,
    Load,
    Potentiometer,
    Thermometer,
)
from muscle_bayes.data.errors import RunError
from muscle_bayes.data.events import complete_attempt, read_events, recording_of, without_broken_off
from muscle_bayes.data.files import find_runs
from muscle_bayes.data.log import HEADER
from muscle_bayes.data.reader import read_run, read_runs
from muscle_bayes.data.repairing.ledger import Repair
from muscle_bayes.data.run import Run
from muscle_bayes.data.sensor import Sensor
from muscle_bayes.data.writer import write_run

__all__ = [
    "HEADER",
    "HEATER_HEADER",
    "ArmElement",
    "Assumption",
    "Columns",
    "Drive",
    "Element",
    "Fixture",
    "Heater",
    "Load",
    "LogFormat",
    "Metadata",
    "MuscleElement",
    "NoElement",
    "Origin",
    "Potentiometer",
    "Protocol",
    "Repair",
    "Run",
    "RunError",
    "Sensor",
    "SpringElement",
    "Thermometer",
    "assumptions",
    "complete_attempt",
    "find_runs",
    "read_events",
    "read_metadata",
    "read_run",
    "read_runs",
    "recording_of",
    "without_broken_off",
    "write_run",
]
