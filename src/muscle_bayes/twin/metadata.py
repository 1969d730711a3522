"""What an experimenter writes down about a run: geometry and loads, never the truth."""

from typing import Any

from muscle_bayes.data import Metadata
from muscle_bayes.twin.plant.rig import Element, Rig
from muscle_bayes.twin.protocols import Protocol

NOTES = "Synthetic: written by the simulator of this project, not measured."


def describe(rig: Rig, protocol: Protocol, load: tuple[list[float], list[float]]) -> Metadata:
    """Metadata of a run whose load table [s, kg] is given."""
    fixture = rig.fixture
    table: dict[str, Any] = {
        "disc_radius": fixture.disc_radius,
        "stops": fixture.stops,
        "room_temperature": fixture.room_temperature,
    }
    for side, element in (("a", rig.element_a), ("b", rig.element_b)):
        if element.kind != "none":
            for key in ("rotor_radius", "anchor_x", "anchor_y"):
                table[f"{key}_{side}"] = getattr(fixture, f"{key}_{side}")
    muscle = "muscle" in (rig.element_a.kind, rig.element_b.kind)
    times, masses = load
    return Metadata.model_validate(
        {
            "format": 1,
            "protocol": protocol.name,
            "origin": "synthetic",
            "notes": NOTES,
            "fixture": table,
            "potentiometer": {
                "zero_reading": rig.potentiometer.zero_reading,
                "radians_per_count": rig.potentiometer.radians_per_count,
            },
            **({"thermometer": {"delay": 0.0}} if muscle else {}),
            "element_a": _element(rig.element_a),
            "element_b": _element(rig.element_b),
            "load": {"time": tuple(times), "mass": tuple(masses)},
        }
    )


def _element(element: Element) -> dict[str, Any]:
    if element.kind == "spring":
        return {"kind": "spring", "model": "reference"}
    if element.kind != "muscle":
        return {"kind": element.kind}
    table: dict[str, Any] = {"kind": "muscle", "base_length": element.base_length}
    if element.heater_length is not None:
        table["heater_length"] = element.heater_length
    return table
