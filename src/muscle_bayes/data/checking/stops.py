"""Readings against the endstops that the metadata state."""

import numpy as np

from muscle_bayes.data.describing.metadata import Metadata
from muscle_bayes.data.repairing.ledger import Ledger
from muscle_bayes.data.sensor import sensor_of

_SHARE = 0.02
"""How far beyond an endstop a reading may lie, as a share of the way between the two."""


def refuse_beyond_stops(ledger: Ledger, metadata: Metadata) -> None:
    """A rotor cannot be beyond its endstops: one of the two is wrong.

    Three standard uncertainties of the sensor's zero, two of its steps and a fiftieth of the way
    between the stops are allowed for.

    Raises:
        RunError: a reading lies farther out.
    """
    stops = metadata.fixture.stops
    if stops is None or metadata.measured == "velocity" or not ledger.lines.size:
        return
    reading = ledger.columns["reading"]
    sensor = sensor_of(metadata, reading)
    q = sensor.coordinate(reading)
    slack = sensor.scale * (3 * sensor.zero_uncertainty + 2 * sensor.resolution)
    slack += _SHARE * (stops[1] - stops[0])
    beyond = (q < stops[0] - slack) | (q > stops[1] + slack)
    if not beyond.any():
        return
    first = int(np.flatnonzero(beyond)[0])
    unit = "m" if metadata.fixture.motion == "linear" else "rad"
    fix = (
        "correct fixture.stops, remove it where there are no endstops, or correct the sensor's zero "
        "and scale"
    )
    whole = bool(np.all(reading == np.rint(reading)))
    if whole and metadata.output.kind == "angle" and abs(q[first]) > np.pi:
        fix = (
            f"is position_unit right (readings of {reading[first]:g} look like counts)? Else {fix}"
        )
    raise ledger.refusal(
        f"{int(beyond.sum())} of {beyond.size} readings lie beyond the endstops "
        f"{list(stops)} {unit}, the first at {q[first]:.5g} {unit}",
        fix,
        first,
        "reading",
        "fixture.stops",
    )
