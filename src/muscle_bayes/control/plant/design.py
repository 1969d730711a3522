"""The joint that is to be controlled: geometry and sensors, from a TOML file or as on the bench."""

from pathlib import Path

from pydantic import BaseModel, ConfigDict

from muscle_bayes.control.plant.sensors import Potentiometer, Thermocouples
from muscle_bayes.data import Fixture, Metadata, RunError
from muscle_bayes.data.describing.elements import MuscleElement
from muscle_bayes.data.describing.tables import Potentiometer as PotentiometerTable
from muscle_bayes.data.validation import faults_told, read_table
from muscle_bayes.inference.records.rig import rig
from muscle_bayes.physics.plant import Plant

_SIDES = {
    f"{key}_{side}": value
    for side in "ab"
    for key, value in (("rotor_radius", 0.030), ("anchor_x", 0.030), ("anchor_y", 0.115))
}


class Design(BaseModel):
    """The rig's tables of a TOML file, with a muscle on both sides; other tables are not looked at.

    The defaults are the bench's fixture with its second muscle mounted like the first. The thesis
    does not say how its simulated joint was proportioned.
    """

    model_config = ConfigDict(frozen=True, strict=True)

    fixture: Fixture = Fixture(**_SIDES, disc_radius=0.0889, stops=(-1.2, 1.2))
    potentiometer: PotentiometerTable = PotentiometerTable(
        zero_reading=512.0, radians_per_count=0.0058
    )
    element_a: MuscleElement = MuscleElement(base_length=0.100)
    element_b: MuscleElement = MuscleElement(base_length=0.100)

    def plant(self) -> Plant:
        """The plant with J, friction and muscle parameters still unknown (NaN)."""
        return rig(
            Metadata(
                protocol="free",
                origin="synthetic",
                fixture=self.fixture,
                potentiometer=self.potentiometer,
                element_a=self.element_a,
                element_b=self.element_b,
            )
        )

    def sensors(self) -> tuple[Potentiometer, Thermocouples]:
        """The bench's sensors."""
        table = self.potentiometer
        return Potentiometer(table.radians_per_count, table.zero_reading), Thermocouples()


def read_design(path: Path) -> Design:
    """Read a joint's TOML; any run's NAME.toml with two muscles is one. Raises RunError."""
    design = read_table(path, Design)
    with faults_told(path, Design):
        design.plant()
    if design.fixture.motion != "rotary":
        raise RunError.at(path, "is linear", "a joint turns", key="fixture.motion")
    return design
